"""Errors of the master side; messages say what happened, where, and what to do."""

from __future__ import annotations

from typing import Final

_MORE_ABORTS: Final = {
    0x06010003: "sub-index cannot be written, sub-index 0 must be 0 first",
    0x06010004: "complete access is not supported for this object",
}
"""Codes that CiA 301 defines and the `canopen` package does not."""
_ABORT_GROUPS: Final = {
    0x0503: "toggle bit error",
    0x0504: "SDO protocol error",
    0x0601: "unsupported access",
    0x0602: "object does not exist",
    0x0604: "mapping or compatibility error",
    0x0606: "hardware error",
    0x0607: "length error",
    0x0609: "value error",
    0x060A: "resource not available",
    0x0800: "general error",
}


def abort_text(code: int) -> str:
    """Return an SDO abort code (CiA 301) as text, with the number."""
    # imported at the first error: the import takes longer than most commands need to start
    from canopen.sdo.exceptions import SdoAbortedError  # noqa: PLC0415

    text = _MORE_ABORTS.get(code) or SdoAbortedError.CODES.get(code)
    if text is None:
        group = _ABORT_GROUPS.get(code >> 16)
        text = f"{group} (not a standard code)" if group else "not a standard code"
    elif text[1].islower():
        text = text[0].lower() + text[1:]
    return f"{text} ({code:08X}h)"


class DriverError(Exception):
    """Base of all errors that the master side raises on purpose."""


class ConfigurationError(DriverError):
    """Request, robot file and buses are inconsistent; nothing has power."""


class BusError(DriverError):
    """The CAN bus cannot be named or opened, or is no longer usable."""


class SdoError(DriverError):
    """An object of a node could not be read or written; names node, object and reason."""


class SdoAbortError(SdoError):
    """The node or this client has aborted a transfer; `code` is the abort code of CiA 301."""

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
    """A drive reports a fault or did not reach the requested state."""


class ModeRefusedError(DriverError):
    """A drive rejects the requested mode of operation."""
