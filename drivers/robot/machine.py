"""The daemon's machine: a robot's drives on their buses, its brakes and its safety I/O."""

from __future__ import annotations

import gc
from collections.abc import Callable, Mapping, Sequence
from contextlib import ExitStack
from dataclasses import replace
from functools import wraps
from typing import Any, Concatenate, Final, ParamSpec, TypeVar

import numpy as np

from cdpr_drivers.axes import touch_probe
from cdpr_drivers.axes.axis_buses import AxisBuses
from cdpr_drivers.bus.health import BusHealth
from cdpr_drivers.bus.simulated_bus import open_clock
from cdpr_drivers.canopen.boot.boot import BootReport
from cdpr_drivers.canopen.network import CanNetwork
from cdpr_drivers.cia402 import POWER_OFF, State, state_of
from cdpr_drivers.errors import BusError, DriverError
from cdpr_drivers.robot.commissioned import check_drive_identities, identity_of, load_profiles
from cdpr_drivers.robot.robot_boot import (
    boot_notes,
    boot_robot,
    device_of,
    faults_text,
    open_networks,
)
from cdpr_drivers.robot.robot_buses import robot_urls
from cdpr_drivers.robot.safety import SessionSafety, connect
from cdpr_drivers.robot.tensions import RobotTensions
from cdpr_profiles import Robot
from cdpr_profiles.errors import ProfileError
from cdpr_rt.core.cycle import Watch
from cdpr_rt.core.supervision.limits import Limits
from cdpr_rt.core.tension_feedback import TensionFeedback
from cdpr_rt.errors import ControlError
from cdpr_rt.robots.robot_arrays import limits_of
from cdpr_rt.runtime.machine import MachineError

_P = ParamSpec("_P")
_T = TypeVar("_T")
_ERRORS: Final = (DriverError, ProfileError, ControlError, OSError)


def _as_machine_error(
    work: Callable[Concatenate[RobotMachine, _P], _T],
) -> Callable[Concatenate[RobotMachine, _P], _T]:
    """Have everything that goes wrong in `work` raised as MachineError."""

    @wraps(work)
    def wrapped(machine: RobotMachine, /, *args: _P.args, **kwargs: _P.kwargs) -> _T:
        try:
            return work(machine, *args, **kwargs)
        except _ERRORS as error:
            notes = getattr(error, "__notes__", [])
            raise MachineError("; ".join([str(error), *notes])) from error

    return wrapped


class RobotMachine:
    """All axes of `robot` on the buses given with --bus; implements `Machine`.

    There is power only while the `safety_io` allows it: the robot's own where none is named, unless
    all buses are simulated. Tensions are measured where their sensors are at a `tension_port`.
    Simulated buses in lockstep go on as fast as they can, in `real_time` no faster than wall time.
    Axes that are not mandatory are left out where they do not boot, if they may be `optional`.
    Its `limits` are those of its file if left out.
    """

    failures: tuple[type[Exception], ...] = (BusError,)
    read_only = False

    def __init__(
        self,
        robot: Robot,
        buses: Sequence[str],
        safety_io: str | None = None,
        tension_port: str | None = None,
        *,
        real_time: bool = False,
        optional: bool = False,
        limits: Limits | None = None,
    ) -> None:
        self.robot = robot
        """Its axes are those which have booted, once they have."""
        self._optional = optional
        limits = limits or limits_of(robot)
        self._torque_Nm = np.broadcast_to(limits.torque_Nm, (len(robot.axes),)).tolist()
        self._missed_cycles = limits.missed_cycles
        self._profiles = load_profiles(robot, limits)
        self._urls = robot_urls(robot, buses)
        self.clock = open_clock(self._urls.values(), real_time=real_time)
        real = not all(url.is_simulated for url in self._urls.values())
        self._tensions = RobotTensions(robot, tension_port)
        self._reference = safety_io or (robot.safety_io if real else None)
        self.device: AxisBuses | None = None
        """The booted axes, None until `open` and after `close`."""
        self.watches: Sequence[Watch] = ()
        self.notices: Sequence[str] = ()
        self.networks: dict[str, CanNetwork] = {}
        """The buses, by the robot's names of them, once the drives have booted."""
        self.reports: Sequence[BootReport] = ()
        """What each drive reported when it booted, in the order of the axes."""
        self._drives: dict[str, dict[str, dict[str, int]]] = {}
        self._safety: SessionSafety | None = None
        self._stack = ExitStack()

    # -- slow

    @_as_machine_error
    def open(self) -> None:
        """Open the buses and boot the drives; they are left without power."""
        with ExitStack() as stack:
            self._safety = self._open_safety(stack)
            self._tensions.open(stack, self.clock)
            networks = open_networks(stack, self.robot, self._urls, self.clock)
            booted, absent = boot_robot(stack, self.robot, networks, self._torque_Nm)
            device = device_of(self.robot, networks, booted, self._torque_Nm)
            notices = boot_notes(self.robot, booted, absent)
            if absent:
                self._leave_out(absent)
            reports = list(booted.values())
            check_drive_identities(self.robot, self._profiles, reports)
            stack.callback(device.close)
            # the supervisor judges silence before the device does
            device.tolerate_silence(self._missed_cycles + 1)
            unsought = self._seek_indices(device)
            # the collector keeps every thread waiting: it looks at what stays now, and never again
            gc.collect()
            gc.freeze()
            for network in networks.values():
                network.start_heartbeat()
            self._stack = stack.pop_all()
        self.networks, self.reports = networks, reports
        self._drives = self._identities()
        notices += [self._tensions.missing(self.robot), *unsought, self._idle_brakes()]
        self.notices = [notice for notice in notices if notice]
        self.watches = () if self._safety is None else (self._safety.io,)
        self.device = device

    def _leave_out(self, absent: Mapping[int, str]) -> None:
        """Go on as a robot without the axes that have not booted; raises MachineError."""
        if not self._optional:
            raise MachineError(
                "; ".join(f"{self.robot.axes[i].name}: {reason}" for i, reason in absent.items())
                + " (the daemon runs all axes of a robot or none)"
            )
        present = [i for i in range(len(self.robot.axes)) if i not in absent]
        self._profiles = tuple(self._profiles[i] for i in present)
        self._torque_Nm = [self._torque_Nm[i] for i in present]
        self.robot = replace(self.robot, axes=tuple(self.robot.axes[i] for i in present))

    def _seek_indices(self, device: AxisBuses) -> list[str]:
        """Have each drive latch its encoder's index in whatever motion comes (touch probe).

        It must, where a cogging profile counts from it. A daemon seeks all others as well: they
        show whether a platform's motors were turned while no loop ran, and sweeps count from them;
        returns why one of them is not sought.
        """
        notes = []
        for i, (axis, profile) in enumerate(zip(self.robot.axes, self._profiles, strict=True)):
            group, place = device.group_of(i)
            if profile is not None:
                touch_probe.arm(group, place)
            elif not self._optional and group.reports_probe(place):
                try:
                    touch_probe.arm(group, place)
                except DriverError as error:
                    notes.append(f"{axis.name}: its encoder's index is not sought: {error}")
        return notes

    def _open_safety(self, stack: ExitStack) -> SessionSafety | None:
        if self._reference is None:
            return None
        io = stack.enter_context(connect(self._reference, self.clock))
        return SessionSafety(io, [axis.node_id for axis in self.robot.axes])

    def _idle_brakes(self) -> str:
        safety = self._safety
        if safety is None or safety.braked or not any(a.brake for a in safety.io.profile.axes):
            return ""
        return "none of the safety I/O's brakes belongs to these nodes (key node_id): none moves"

    @_as_machine_error
    def prepare(self) -> None:
        """Close the contactor and have each drive take torques."""
        self._tensions.read()
        if trouble := self._tensions.trouble():
            raise MachineError(trouble)
        if self._safety is not None and not self._safety.io.state.contactor_closed:
            self._safety.io.energise()
        device = self._booted
        device.ask_mode(device.torque_modes)

    @_as_machine_error
    def acknowledge(self) -> None:
        """Forget what the safety I/O has latched, whose cause is gone."""
        if self._safety is not None and self._safety.tripped:
            self._safety.io.de_energise()  # it acknowledges while it does not watch
            self._safety.io.acknowledge()

    @_as_machine_error
    def pause(self) -> None:
        """Leave the drives, which have no power, for a while without cycles."""
        self._booted.stop_cycling()

    @_as_machine_error
    def confirm_power_off(self) -> str:
        """See to it that no drive has power which does not answer; return what is uncertain."""
        device = self._booted
        unconfirmed, lost = [], dict[str, list[str]]()
        for axis, state in zip(self.robot.axes, device.states(), strict=True):
            if state in POWER_OFF:
                continue
            try:
                off = self.networks[axis.bus].switch_off(axis.node_id)
            except BusError as error:
                lost.setdefault(str(error), []).append(axis.name)
                continue
            if not off:
                unconfirmed.append(
                    f"{axis.name}: does not confirm that its power is off; it was reset"
                )
        unconfirmed += [
            f"{', '.join(names)}: not known to be without power: {why}"
            for why, names in lost.items()
        ]
        return "; ".join(unconfirmed)

    @_as_machine_error
    def explain(self, reason: str) -> str:
        """Return `reason` with what drives and safety I/O say of it."""
        device = self.device
        if device is not None and device.faulted().any():
            faults = faults_text(self.robot.axes, device, self.networks, reason)
            reason = f"{reason}: {faults}" if faults else reason
        return reason if self._safety is None else self._safety.cause(reason)

    @_as_machine_error
    def close(self) -> str:
        """Take the power from the drives and leave the buses; return what stayed uncertain."""
        device, self.device = self.device, None
        self.watches = ()
        unconfirmed = ""
        try:
            if device is not None:
                if self._safety is not None:
                    self._safety.drop_brakes()
                unconfirmed = device.close()
        finally:
            self._stack.close()
        return unconfirmed

    @property
    def _booted(self) -> AxisBuses:
        if self.device is None:
            raise MachineError("the drives have not booted")
        return self.device

    # -- in a cycle

    def read_tension(self) -> TensionFeedback | None:
        """Return the tensions as last read, None where none are measured."""
        return self._tensions.read()

    def bus_state(self) -> dict[str, Any]:
        """Return what is known of each bus, by its name."""
        return {
            name: {
                "url": str(url),
                "state": "" if (health := self._health(name)) is None else health.text,
                "counts": {} if health is None else health.counts(),
                "drives": self._drives.get(name, {}),
            }
            for name, url in self._urls.items()
        }

    def _health(self, bus: str) -> BusHealth | None:
        return self.networks[bus].health if bus in self.networks else None

    def _identities(self) -> dict[str, dict[str, dict[str, int]]]:
        """Return what tells the drives that have booted from others, by bus and axis."""
        drives: dict[str, dict[str, dict[str, int]]] = {}
        for axis, report in zip(self.robot.axes, self.reports, strict=True):
            drives.setdefault(axis.bus, {})[axis.name] = identity_of(report).model_dump()
        return drives

    @property
    def safety(self) -> str:
        """Name of the safety I/O, which guards the power besides the bus; empty without one."""
        return "" if self._safety is None else self._safety.io.name

    @_as_machine_error
    def prepared(self) -> bool:
        """Whether the drives confirm the mode in which they take torques."""
        return self._booted.mode_confirmed()

    def unprepared(self) -> str:
        """Return which drive does not confirm its mode, and what it says in place of it."""
        return str(self._booted.unconfirmed_mode())

    @_as_machine_error
    def power_on(self) -> None:
        """Ask all drives for their power."""
        self._booted.request(State.OPERATION_ENABLED)

    def power_off(self) -> None:
        """Take torque and power from all drives with this cycle's command."""
        if self.device is not None:
            self.device.request(State.SWITCH_ON_DISABLED)

    def quick_stop(self) -> None:
        """Have all drives brake by themselves, then switch off, from this cycle's command on."""
        if self.device is not None:
            self.device.request(State.QUICK_STOP)

    def powered(self) -> bool:
        """Whether all drives have their power and obey."""
        return self.device is not None and self.device.reached(State.OPERATION_ENABLED)

    def unpowered(self) -> bool:
        """Whether no drive that can be heard has power, by what it said last.

        An answer that is missing says nothing: a quick stop would be cut short by it.
        """
        device = self.device
        if device is None:
            return True
        reported = zip(device.feedback.statusword, device.feedback.alive, strict=True)
        # one that has never answered reads as not ready
        return all(state_of(int(word)) in POWER_OFF or not alive for word, alive in reported)

    def reset_faults(self) -> None:
        """Forget latched alarms and have faults reset in the cycles that follow."""
        if self.device is not None:
            self.device.acknowledge_fault()

    def intact(self) -> bool:
        """Whether every drive answers and needs no new boot."""
        device = self.device
        return device is not None and bool(
            device.feedback.alive.all() and device.feedback.valid.all()
        )

    def faultless(self) -> bool:
        """Whether no drive is in fault."""
        faults = (State.FAULT, State.FAULT_REACTION)
        return self.device is not None and not any(s in faults for s in self.device.states())

    @_as_machine_error
    def set_brakes(self, released: bool) -> None:
        """Have the brakes released or applied; does not wait for them."""
        if self._safety is not None and self._safety.braked:
            move = self._safety.io.release_brakes if released else self._safety.io.apply_brakes
            move(*self._safety.braked)

    def brakes_are(self, released: bool) -> bool:
        """Whether the brakes have followed; true where there are none."""
        if self._safety is None or not self._safety.braked:
            return True
        brakes = self._safety.io.state.brakes_released
        return all(brakes[axis] == released for axis in self._safety.braked)

    @property
    def has_brakes(self) -> bool:
        """Whether every axis has a brake that holds it without power."""
        braked = () if self._safety is None else self._safety.braked
        return len(braked) == len(self.robot.axes)

    def states(self) -> list[str]:
        """Return what each drive says of itself, in the standard's words."""
        if self.device is None:
            return []
        return [
            f"{axis.name} is {state.label}"
            for axis, state in zip(self.robot.axes, self.device.states(), strict=True)
        ]
