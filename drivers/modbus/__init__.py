"""Modbus devices beside the drives: serial lines, load cells, remote inputs and outputs."""
