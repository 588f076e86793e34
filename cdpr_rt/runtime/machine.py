"""Interface of the control loop to drives, brakes and safety I/O; it knows no bus."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Protocol

from cdpr_rt.core.clock import Clock
from cdpr_rt.core.cycle import Watch
from cdpr_rt.core.exchange import AxisDevice
from cdpr_rt.core.tension_feedback import TensionFeedback
from cdpr_rt.errors import ControlError


class MachineError(ControlError):
    """The drives could not be booted, prepared or left; the message says which and why."""


class Machine(Protocol):
    """The axes of one robot with their buses, brakes and safety I/O.

    The slow methods are called in a task of `clock`, while cycles run or not, and wait by it alone;
    they raise MachineError. All others are called in a cycle and wait for nothing.
    """

    failures: tuple[type[Exception], ...]
    """The exceptions that the device raises when a bus is lost."""
    read_only: bool
    """Whether nothing is ever sent, because another master runs the axes."""
    watches: Sequence[Watch]
    notices: Sequence[str]
    """Notices on the booted drives, for the status."""

    @property
    def clock(self) -> Clock:
        """The robot's time; one object for the life of the machine."""

    @property
    def device(self) -> AxisDevice | None:
        """The booted axes, None until `open` and after `close`."""

    @property
    def safety(self) -> str:
        """Name of the safety I/O, for the status; empty without one."""

    @property
    def has_brakes(self) -> bool:
        """Whether every axis has a brake that holds it without power."""

    # -- slow

    def open(self) -> None:
        """Open the buses and boot the drives; they are left without power."""

    def prepare(self) -> None:
        """Prepare a check: close the contactor, set the mode of operation."""

    def acknowledge(self) -> None:
        """Acknowledge what the safety I/O has latched."""

    def pause(self) -> None:
        """Leave the drives, which have no power, without cycles until `prepare`."""

    def confirm_power_off(self) -> str:
        """Remove the power of drives that do not answer; return what is unconfirmed."""

    def explain(self, reason: str) -> str:
        """Return `reason` with what drives and safety I/O report of it."""

    def close(self) -> str:
        """Remove the drives' power and leave the buses; return what is unconfirmed."""

    # -- in a cycle

    def read_tension(self) -> TensionFeedback | None:
        """Return the tensions as last read, None where none are measured."""

    def bus_state(self) -> dict[str, Any]:
        """Return what is known of each bus, by its name."""

    def prepared(self) -> bool:
        """Whether the drives confirm what `prepare` asked of them."""

    def unprepared(self) -> str:
        """Return which drive does not confirm what `prepare` asked of it."""

    def power_on(self) -> None:
        """Enable all drives; raises MachineError where one must not be."""

    def power_off(self) -> None:
        """Remove torque and power of all drives with this cycle's command."""

    def quick_stop(self) -> None:
        """Have all drives brake by themselves, then switch off, from this cycle's command on."""

    def powered(self) -> bool:
        """Whether all drives have their power and obey."""

    def unpowered(self) -> bool:
        """Whether no drive that answers has power, by its last answer."""

    def reset_faults(self) -> None:
        """Clear latched alarms and reset the drives' faults in the cycles that follow."""

    def intact(self) -> bool:
        """Whether every drive answers and needs no new boot."""

    def faultless(self) -> bool:
        """Whether no drive is in fault."""

    def set_brakes(self, released: bool) -> None:
        """Release or apply the brakes, without waiting for them."""

    def brakes_are(self, released: bool) -> bool:
        """Whether the brakes have followed; true where there are none."""

    def states(self) -> list[str]:
        """Return each drive's state, in the words of CiA 402."""
