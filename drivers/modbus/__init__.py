"""Modbus devices other than drives: serial lines, load cells, remote inputs and outputs."""
