"""Errors of the runtime; each message gives the problem, its place, and the allowed values."""


class ControlError(Exception):
    """An operation of the runtime failed."""


class InvalidRequestError(ControlError):
    """A procedure cannot begin or continue as requested; no motor has power."""


class TripError(ControlError):
    """The supervisor or the device ended the motion; the message says which limit and value."""


class NotInTimeError(TripError):
    """A procedure that runs in the device took longer than allowed."""


class InterruptedMotionError(ControlError):
    """The operator requested a stop; the motion ended under control."""


class RawLogError(ControlError):
    """A raw measurement file cannot be written or read."""


class GeometryError(ControlError):
    """A geometry that is impossible; the message names the cable and the value."""
