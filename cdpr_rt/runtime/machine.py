"""What the control loop needs of the drives and of what guards them; it knows no bus itself."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Protocol

from cdpr_rt.clock import Clock
from cdpr_rt.cycle import Watch
from cdpr_rt.errors import ControlError
from cdpr_rt.exchange import AxisDevice
from cdpr_rt.tension import TensionFeedback


class MachineError(ControlError):
    """The drives could not be booted, prepared or left; the message says which and why."""


class Machine(Protocol):
    """The axes of one robot with their buses, brakes and guards.

    The slow methods are called in a task of `clock`, while cycles run or not, and wait by it alone;
    they raise MachineError. All others are called in a cycle and wait for nothing.
    """

    failures: tuple[type[Exception], ...]
    """What the device raises when a bus is gone."""
    read_only: bool
    """Whether nothing is ever sent, because another master runs the axes."""
    watches: Sequence[Watch]
    notices: Sequence[str]
    """What people should know of the drives that have booted."""

    @property
    def clock(self) -> Clock:
        """The robot's time, the same one from beginning to end."""

    @property
    def device(self) -> AxisDevice | None:
        """The booted axes, None until `open` and after `close`."""

    @property
    def safety(self) -> str:
        """What guards the power besides the bus, for people."""

    @property
    def has_brakes(self) -> bool:
        """Whether every axis has a brake that holds it without power."""

    # -- slow

    def open(self) -> None:
        """Open the buses and boot the drives; they are left without power."""

    def prepare(self) -> None:
        """Do what must be done before cycles run for a check: contactor, mode of operation."""

    def acknowledge(self) -> None:
        """Forget what the guards have latched, whose cause is gone."""

    def pause(self) -> None:
        """Leave the drives, which have no power, for a while without cycles."""

    def make_sure(self) -> str:
        """See to it that no drive has power which does not answer; return what is uncertain."""

    def explain(self, reason: str) -> str:
        """Return `reason` with what drives and guards say of it when they are asked."""

    def close(self) -> str:
        """Take the power from the drives and leave the buses; return what stayed uncertain."""

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
        """Ask all drives for their power; raises MachineError where one must not have it."""

    def power_off(self) -> None:
        """Take torque and power from all drives with this cycle's command."""

    def quick_stop(self) -> None:
        """Have all drives brake by themselves, then switch off, from this cycle's command on."""

    def powered(self) -> bool:
        """Whether all drives have their power and obey."""

    def unpowered(self) -> bool:
        """Whether no drive that can be heard has power, by what it said last."""

    def reset_faults(self) -> None:
        """Forget latched alarms and have faults reset in the cycles that follow."""

    def intact(self) -> bool:
        """Whether every drive answers and needs no new boot."""

    def faultless(self) -> bool:
        """Whether no drive is in fault."""

    def set_brakes(self, released: bool) -> None:
        """Have the brakes released or applied; does not wait for them."""

    def brakes_are(self, released: bool) -> bool:
        """Whether the brakes have followed; true where there are none."""

    def states(self) -> list[str]:
        """Return what each drive says of itself, in the standard's words."""
