"""Errors of the simulator; every message names the error and the allowed values."""


class SimulatorError(Exception):
    """Base of all errors that the simulator raises on purpose."""


class BusSetupError(SimulatorError):
    """The simulated bus cannot be named or opened."""


class RequestError(SimulatorError):
    """A client's request that the simulator rejects."""
