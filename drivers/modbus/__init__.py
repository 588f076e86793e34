"""Devices on Modbus: load-cell amplifiers, remote I/O, position axes."""
