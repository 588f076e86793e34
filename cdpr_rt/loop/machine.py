"""Interface of the control loop to drives, brakes and safety I/O, independent of the bus."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Protocol

from cdpr_rt.core.clock import Clock
from cdpr_rt.core.cycle import Watch
from cdpr_rt.core.exchange import AxisDevice, TensionFeedback
from cdpr_rt.core.fault import Fault
from cdpr_rt.errors import ControlError


class MachineError(ControlError):
    """Drives could not be booted, prepared or released; the message gives the drive and the
    reason.
    """


class Machine(Protocol):
    """The axes of one robot with their buses, brakes and safety I/O.

    The slow methods are called in a task of `clock`, with or without running cycles. They wait only
    by this clock, and raise MachineError. All other methods are called in a cycle and never wait.
    """

    failures: tuple[type[Exception], ...]
    """The exceptions that the device raises when a bus is lost."""
    read_only: bool
    """Whether the machine never sends anything, because another master runs the axes."""
    watches: Sequence[Watch]
    notices: Sequence[str]
    """Notices about the booted drives, for the status."""

    @property
    def clock(self) -> Clock:
        """The robot's clock; one object for the life of the machine."""

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
        """Acknowledge the latched alarms of the safety I/O."""

    def pause(self) -> None:
        """Stop the cycles of the unpowered drives until `prepare`."""

    def confirm_power_off(self) -> Sequence[Fault]:
        """Remove the power of drives that do not answer; return a fault for each that does not
        confirm.
        """

    def explain(self) -> Sequence[Fault]:
        """Return the faults that drives and the safety I/O report now."""

    def read_object(self, axis: int, index: int, sub: int) -> bytes:
        """Return the data of an object of an axis' drive; also while it has power."""

    def write_object(self, axis: int, index: int, sub: int, value: int) -> None:
        """Write an integer object of an axis' drive, while no cycles run."""

    def close(self) -> str:
        """Remove the drives' power and close the buses; return the drive that does not confirm, or
        "".
        """

    # -- in a cycle

    def read_tension(self) -> TensionFeedback | None:
        """Return the last readings of tensions, None if they are not measured."""

    def bus_state(self) -> dict[str, Any]:
        """Return the known state of each bus, by its name."""

    def heartbeat_age_s(self) -> list[float]:
        """Return the time since each drive's last heartbeat, while cycles run."""

    def prepared(self) -> bool:
        """Whether the drives confirm the settings of `prepare`."""

    def unprepared(self) -> str:
        """Return as text which drive does not confirm the settings of `prepare`."""

    def power_on(self) -> None:
        """Enable all drives; raises MachineError if one must not be enabled."""

    def power_off(self) -> None:
        """Remove torque and power of all drives with this cycle's command."""

    def switch_off_lost(self) -> None:
        """Begin to remove the power of drives that do not follow the cycle, in tasks."""

    def quick_stop(self) -> None:
        """Command the drives' own quick stop, then switch-off, from this cycle's command on."""

    def powered(self) -> bool:
        """Whether all drives have power and follow commands."""

    def unpowered(self) -> bool:
        """Whether no drive that answers has power, by its last answer."""

    def reset_faults(self) -> None:
        """Clear latched alarms and reset the drives' faults in the following cycles."""

    def intact(self) -> bool:
        """Whether every drive answers and does not need to boot again."""

    def faultless(self) -> bool:
        """Whether no drive is in fault."""

    def set_brakes(self, released: bool) -> None:
        """Release or apply the brakes, without waiting for them."""

    def brakes_are(self, released: bool) -> bool:
        """Whether the brakes have followed; true without brakes."""

    def states(self) -> list[str]:
        """Return each drive's state, by its name in CiA 402."""
