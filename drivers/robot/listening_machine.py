"""The daemon's machine if another master runs the robot: it listens and sends nothing."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Final

from cdpr_drivers.axes.listening import ListeningDevice, MonitoredBus, monitored_axis
from cdpr_drivers.cia402 import POWER_OFF, State
from cdpr_drivers.errors import BusError, DriverError
from cdpr_drivers.robot.robot_buses import robot_urls
from cdpr_profiles import Robot
from cdpr_rt.core.clock import PacedClock
from cdpr_rt.core.cycle import Watch
from cdpr_rt.core.exchange import TensionFeedback
from cdpr_rt.core.fault import Fault
from cdpr_rt.loop.machine import MachineError

_MASTER_S: Final = 1.0
_NOTICE: Final = "read-only: nothing is sent; another master runs the drives"


class ListeningMachine:
    """All axes of `robot`, received from the buses given with --bus; implements `Machine`.

    Operations that would send are rejected, or skipped if they are part of closing.
    """

    failures: tuple[type[Exception], ...] = (BusError,)
    read_only = True
    has_brakes = False
    watches: Sequence[Watch] = ()
    notices: Sequence[str] = (_NOTICE,)
    safety = ""
    """Empty: the other master monitors the safety I/O."""

    def __init__(self, robot: Robot, buses: Sequence[str]) -> None:
        self.clock = PacedClock()
        self._robot = robot
        self._urls = robot_urls(robot, buses)
        self.device: ListeningDevice | None = None
        """The monitored axes; None until `open` and after `close`."""
        self._sync_deadline_s = 0.0

    # -- slow

    def open(self) -> None:
        """Join the buses; raises MachineError."""
        robot = self._robot
        buses = []
        for name, url in self._urls.items():
            axis_numbers = robot.axes_on(name)
            on_bus = [robot.axes[i] for i in axis_numbers]
            axes = [monitored_axis(axis.winch, axis.node_id, axis.name) for axis in on_bus]
            buses.append(MonitoredBus(name, url, axes, axis_numbers))
        try:
            self.device = ListeningDevice(buses, robot.sync_period_s, self.clock)
        except DriverError as error:
            raise MachineError(str(error)) from error

    def prepare(self) -> None:
        """Start to wait for the other master's SYNC."""
        self._sync_deadline_s = self.clock.now_s + _MASTER_S

    def acknowledge(self) -> None:
        """Do nothing: no safety I/O latches here."""

    def pause(self) -> None:
        """Do nothing: the drives do not notice."""

    def confirm_power_off(self) -> Sequence[Fault]:
        """Return nothing: the other master controls the power."""
        return ()

    def explain(self) -> Sequence[Fault]:
        """Return nothing: the drives are not queried."""
        return ()

    def read_object(self, _axis: int, _index: int, _sub: int) -> bytes:
        """Reject it: it would send."""
        raise MachineError("this daemon only listens (--read-only)")

    def write_object(self, _axis: int, _index: int, _sub: int, _value: int) -> None:
        """Reject it: it would send."""
        raise MachineError("this daemon only listens (--read-only)")

    def heartbeat_age_s(self) -> list[float]:
        """Return nothing: only whether heartbeats arrive in time is known."""
        return []

    def close(self) -> str:
        """Leave the buses; return an empty text, because no drive's power is uncertain."""
        device, self.device = self.device, None
        return "" if device is None else device.close()

    # -- in a cycle

    def read_tension(self) -> TensionFeedback | None:
        """Return None: load cells answer only one master."""
        return None

    def bus_state(self) -> dict[str, Any]:
        """Return the URL of each bus, and whether a master sends on it."""
        state = "closed" if self.device is None else "listening" if self._led else "no master"
        return {name: {"url": str(url), "state": state} for name, url in self._urls.items()}

    @property
    def _led(self) -> bool:
        return self.device is not None and self.device.silent_s < _MASTER_S

    def prepared(self) -> bool:
        """Whether a master runs the axes; raises MachineError after a while without one."""
        if not self._led and self.clock.now_s > self._sync_deadline_s:
            raise MachineError(
                f"no SYNC for {_MASTER_S:g} s: no other master runs {self._robot.name}; "
                "start it, then check again"
            )
        return self._led

    def unprepared(self) -> str:
        """Return, as text, that no other master was detected."""
        return f"no other master runs {self._robot.name}"

    def power_on(self) -> None:
        """Raise MachineError: this machine only listens."""
        raise MachineError(_NOTICE)

    def power_off(self) -> None:
        """Do nothing: the other master controls the power."""

    def switch_off_lost(self) -> None:
        """Do nothing, as `power_off`."""

    def quick_stop(self) -> None:
        """Do nothing, as `power_off`."""

    def powered(self) -> bool:
        """Return False: no drive obeys this loop."""
        return False

    def unpowered(self) -> bool:
        """Whether all drives that answer report no power."""
        return self.device is None or all(state in POWER_OFF for state in self.device.states())

    def reset_faults(self) -> None:
        """Clear the alarms received so far; the drives keep their faults."""
        if self.device is not None:
            self.device.forget_alarms()

    def intact(self) -> bool:
        """Whether the buses still work."""
        return self.device is not None

    def faultless(self) -> bool:
        """Whether no drive is in fault."""
        faults = (State.FAULT, State.FAULT_REACTION)
        return self.device is not None and not any(s in faults for s in self.device.states())

    def set_brakes(self, released: bool) -> None:
        """Do nothing, as `power_off`."""

    def brakes_are(self, released: bool) -> bool:  # noqa: ARG002  # without brakes
        """Return True: there are no brakes to wait for."""
        return True

    def states(self) -> list[str]:
        """Return the state that each drive reports, under its name in the standard."""
        if self.device is None:
            return []
        return [
            f"{axis.name} is {state.label}"
            for axis, state in zip(self._robot.axes, self.device.states(), strict=True)
        ]
