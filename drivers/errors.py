"""Errors of the master side; every message tells what happened, where, and what would help."""


class DriverError(Exception):
    """Base of all errors that the master side raises on purpose."""


class BusError(DriverError):
    """The CAN bus cannot be named, opened or used any more."""
