"""Errors of the master side; messages say what happened, where, and what helps."""

from __future__ import annotations

from cdpr_drivers.canopen.sdo_abort import abort_text


class DriverError(Exception):
    """Base of all errors that the master side raises on purpose."""


class ConfigurationError(DriverError):
    """What was asked for, the robot's file and its buses do not go together; nothing has power."""


class BusError(DriverError):
    """The CAN bus cannot be named, opened or used any more."""


class SdoError(DriverError):
    """An object of a node could not be read or written; names node, object and reason."""


class SdoAbortError(SdoError):
    """A transfer was aborted, by the node or by us; `code` is the abort code of CiA 301."""

    def __init__(self, code: int, context: str = "") -> None:
        self.code = code
        super().__init__(f"{context}{abort_text(code)}")


class SdoTimeoutError(SdoError):
    """A node did not answer in time."""


class SdoCancelledError(SdoError):
    """A transfer was cancelled from another thread."""


class BootError(DriverError):
    """A node did not boot; `letter` is the step of CiA 302-2 that failed.

    B no answer, C device type, D vendor, M product, N revision, O serial number,
    J configuration, K no heartbeat, L already operational.
    """

    def __init__(self, letter: str, node_id: int, problem: str, advice: str) -> None:
        self.letter = letter
        self.node_id = node_id
        self.advice = advice
        super().__init__(f"node {node_id} did not boot (step {letter}): {problem}; {advice}")


class RobotBootError(DriverError):
    """Mandatory drives of a robot did not boot; names each with its bus and reason."""


class DriveFaultError(DriverError):
    """A drive reports a fault or did not reach the state that was asked for."""


class ModeRefusedError(DriverError):
    """A drive does not take the mode of operation that was asked for."""
