"""States of the loop and the transitions between them."""

from __future__ import annotations

from enum import IntEnum
from typing import Final


class LoopState(IntEnum):
    """State of the loop; motors have power in `ACTIVE` only."""

    UNCONFIGURED = 0
    """No bus is open, or the loop is about to open them."""
    INACTIVE = 1
    """The drives have booted; no cycles run."""
    READY = 2
    """The bus has been checked, cycles run, the drives have no power."""
    ACTIVE = 3
    """The drives have power and a program runs."""
    FAULT = 4
    """A fault ended the motion; the state lasts until the fault is acknowledged."""

    @property
    def label(self) -> str:
        """Name as text."""
        return self.name.lower()


CUT_SHORT: Final = "the power was removed while the loop was ending"
"""Reason of a fault: a second request removed the power immediately while the loop ended."""

EMERGENCY_STOP: Final = "emergency stop by cdpr estop"
"""Reason of a fault, or of a loop whose drives a procedure runs, after `cdpr estop`."""


class Transition(IntEnum):
    """Transition that an operator may command."""

    CONFIGURE = 0
    CHECK = 1
    ENABLE = 2
    DISABLE = 3
    ACKNOWLEDGE = 4
    RELEASE = 5


ALLOWED: Final[dict[Transition, tuple[LoopState, ...]]] = {
    Transition.CONFIGURE: (LoopState.UNCONFIGURED, LoopState.INACTIVE),
    Transition.CHECK: (LoopState.INACTIVE, LoopState.READY),
    Transition.ENABLE: (LoopState.READY,),
    Transition.DISABLE: (LoopState.READY, LoopState.ACTIVE),
    Transition.ACKNOWLEDGE: (LoopState.FAULT,),
    Transition.RELEASE: (LoopState.UNCONFIGURED, LoopState.INACTIVE, LoopState.READY),
}
"""The states in which each transition is allowed; in all others it is rejected."""


class Reaction(IntEnum):
    """Reaction of the supervisor to an exceeded limit, in the order of severity."""

    NONE = 0
    CLAMP = 1
    """The value is limited, the motion continues."""
    HOLD = 2
    """The set-point stops; the drives keep their power."""
    CONTROLLED_STOP = 3
    """The motion is braked under its controller, then the power is removed."""
    QUICK_STOP = 4
    """The drives brake on their own (CiA 402 quick stop), then the power is removed."""
    TORQUE_OFF = 5
    """Torque and power are removed immediately, brakes are applied."""

    @property
    def label(self) -> str:
        """Name as text."""
        return self.name.lower().replace("_", " ")
