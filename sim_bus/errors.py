"""Errors of the simulator; every message names what was wrong and what is allowed."""


class SimulatorError(Exception):
    """Base of all errors that the simulator raises on purpose."""


class BusSetupError(SimulatorError):
    """The simulated bus cannot be named or opened."""
