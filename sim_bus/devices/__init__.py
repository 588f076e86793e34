"""Simulated Modbus devices: load cells, safety I/O, rails."""
