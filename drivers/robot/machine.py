"""The daemon's machine: a robot's drives on their buses, its brakes and its safety I/O."""

from __future__ import annotations

import gc
from collections.abc import Callable, Mapping, Sequence
from contextlib import ExitStack
from dataclasses import replace
from functools import wraps
from typing import Any, Concatenate, Final, ParamSpec, TypeVar

import numpy as np

from cdpr_drivers.axes import homing
from cdpr_drivers.axes.axis_buses import AxisBuses
from cdpr_drivers.bus.health import BusHealth
from cdpr_drivers.bus.simbus import open_clock, query_status
from cdpr_drivers.canopen.boot import BootReport
from cdpr_drivers.canopen.network import CanNetwork
from cdpr_drivers.cia402 import POWER_OFF, State, state_of
from cdpr_drivers.errors import BusError, ConfigurationError, DriverError
from cdpr_drivers.modbus.tension import TensionSampler
from cdpr_drivers.robot.commissioned import check_drive_identities, identity_of, load_profiles
from cdpr_drivers.robot.robot_boot import (
    boot_notes,
    boot_robot,
    device_of,
    drive_source,
    open_networks,
    reported_errors,
)
from cdpr_drivers.robot.robot_buses import robot_urls
from cdpr_drivers.robot.safety import SessionSafety, connect
from cdpr_profiles import Robot
from cdpr_profiles.errors import ProfileError
from cdpr_profiles.robot_limits import Limit
from cdpr_profiles.tension_sensor import load_tension_sensors
from cdpr_rt.core.clock import Clock
from cdpr_rt.core.cycle import Watch
from cdpr_rt.core.exchange import TensionFeedback
from cdpr_rt.core.fault import POWER_UNCONFIRMED, POWER_UNKNOWN, Fault
from cdpr_rt.core.supervisor import Limits
from cdpr_rt.errors import ControlError
from cdpr_rt.loop.machine import MachineError
from cdpr_rt.model.robot_arrays import limits_of

# A robot's tension sensors, read beside its control loop.

_FIRST_READINGS_S = 3.0


class RobotTensions:
    """The load cells of a robot, read in parallel to the cycle while they are open.

    Without a `port`, tensions are estimated from torques instead. Raises ConfigurationError for a
    port without configured sensors, and for more sensors than axes.
    """

    def __init__(self, robot: Robot, port: str | None) -> None:
        self._profile, self._port = None, port
        self._sampler: TensionSampler | None = None
        if port is None:
            return
        if robot.tension_sensors is None:
            raise ConfigurationError(
                f"--tension-port {port}: {robot.path} names no sensors (key tension_sensors)"
            )
        self._profile = load_tension_sensors(robot.tension_sensors)

    def open(self, stack: ExitStack, clock: Clock) -> None:
        """Start to read, until `stack` ends it; raises ModbusError for a silent sensor."""
        if self._profile is None or self._port is None:
            return
        self._sampler = stack.enter_context(TensionSampler(self._profile, self._port, clock))
        stack.callback(self._forget)
        self._sampler.await_readings(_FIRST_READINGS_S)

    def _forget(self) -> None:
        self._sampler = None

    def read(self) -> TensionFeedback | None:
        """Return the last tensions, or None if there are no sensors; for the cycle."""
        sampler = self._sampler
        if sampler is None:
            return None
        sampler.exchange.update()
        return sampler.exchange.feedback

    def trouble(self) -> str:
        """Return why the tensions are unreliable, or an empty text."""
        return "" if self._sampler is None else self._sampler.exchange.reason()

    def missing(self, robot: Robot) -> str:
        """Return a note about sensors that nobody reads, or an empty text."""
        if self._profile is not None or robot.tension_sensors is None:
            return ""
        return f"{robot.tension_sensors} is not read: give --tension-port to use it"


_P = ParamSpec("_P")
_T = TypeVar("_T")
_ERRORS: Final = (DriverError, ProfileError, ControlError, OSError)


def _as_machine_error(
    work: Callable[Concatenate[RobotMachine, _P], _T],
) -> Callable[Concatenate[RobotMachine, _P], _T]:
    """Convert every error of `work` to MachineError."""

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

    Power is possible only while the safety I/O allows it. The default of `safety_io` is that of the
    robot's file, or none if all buses are simulated. Tensions are measured if `tension_port` names
    the port of their sensors. Simulated buses in lockstep run as fast as they can; with
    `real_time`, no faster than wall time. If `optional` is set, non-mandatory axes that do not boot
    are left out. By default its `limits` are those of its file.
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
        """The robot; after the boot, it has only the axes that booted."""
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
        """The booted axes; None until `open` and after `close`."""
        self.watches: Sequence[Watch] = ()
        self.notices: Sequence[str] = ()
        self.networks: dict[str, CanNetwork] = {}
        """The buses, by their names in the robot's file; filled after the boot."""
        self.reports: Sequence[BootReport] = ()
        """The report of each drive from its boot, in the order of the axes."""
        self._drives: dict[str, dict[str, dict[str, int]]] = {}
        self._safety: SessionSafety | None = None
        self._stack = ExitStack()

    # -- slow

    @_as_machine_error
    def open(self) -> None:
        """Open the buses and boot the drives; they stay without power."""
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
            # the supervisor must report the silence before the device does
            device.tolerate_silence(self._missed_cycles + 1)
            unsought = self._seek_indices(device)
            if not self.clock.lockstep:
                # garbage collection blocks every thread: collect now, and exempt what remains
                # objects
                gc.collect()
                gc.freeze()
            for network in networks.values():
                network.start_heartbeat()
            self._stack = stack.pop_all()
        self.networks, self.reports = networks, reports
        self._drives = self._identities()
        notices += [self._tensions.missing(self.robot), *unsought, self._idle_brakes()]
        self.notices = [notice for notice in notices if notice]
        self.watches = () if self._safety is None else (self._safety,)
        self.device = device

    def _leave_out(self, absent: Mapping[int, str]) -> None:
        """Continue as a robot without the axes that did not boot; raises MachineError."""
        if not self._optional:
            raise MachineError(
                "; ".join(f"{self.robot.axes[i].name}: {reason}" for i, reason in absent.items())
                + " (the daemon runs all axes of a robot or none)"
            )
        present = [i for i in range(len(self.robot.axes)) if i not in absent]
        self._profiles = tuple(self._profiles[i] for i in present)
        self._torque_Nm = [self._torque_Nm[i] for i in present]
        self.robot = replace(self.robot, axes=tuple(self.robot.axes[i] for i in present))
        if self._safety is not None:
            self._safety.node_ids = [axis.node_id for axis in self.robot.axes]

    def _seek_indices(self, device: AxisBuses) -> list[str]:
        """Let each drive latch its encoder's index in any later motion (touch probe).

        A cogging profile that counts from the index requires it. A daemon also seeks the other
        indices: they show whether motors were turned while no loop ran, and sweeps count from them.
        Returns a note for each of these other indices that it does not seek.
        """
        notes = []
        for i, (axis, profile) in enumerate(zip(self.robot.axes, self._profiles, strict=True)):
            group, place = device.group_of(i)
            if profile is not None:
                homing.arm(group, place)
            elif not self._optional and group.reports_probe(place):
                try:
                    homing.arm(group, place)
                except DriverError as error:
                    notes.append(f"{axis.name}: cannot look for its encoder index: {error}")
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
        return (
            "no brake of the safety I/O belongs to these nodes (key node_id), so no brake will move"
        )

    @_as_machine_error
    def prepare(self) -> None:
        """Close the contactor and request the torque mode of each drive."""
        self._tensions.read()
        if trouble := self._tensions.trouble():
            raise MachineError(trouble)
        if self._safety is not None and not self._safety.io.state.contactor_closed:
            self._safety.io.energise()
        device = self._booted
        device.ask_mode(device.torque_modes)

    @_as_machine_error
    def acknowledge(self) -> None:
        """Acknowledge a trip of the safety I/O whose cause is gone."""
        if self._safety is not None and self._safety.fault():
            # a trip can be acknowledged only while the safety I/O does not monitor
            self._safety.io.de_energise()
            self._safety.io.acknowledge()

    @_as_machine_error
    def pause(self) -> None:
        """Suspend the cycles while the drives have no power."""
        self._booted.stop_cycling()

    @_as_machine_error
    def confirm_power_off(self) -> list[Fault]:
        """Ensure that drives which do not answer have no power; return what remains uncertain."""
        device, uncertain = self._booted, list[Fault]()
        for i, (axis, state) in enumerate(zip(self.robot.axes, device.states(), strict=True)):
            if state in POWER_OFF:
                continue
            code, why = POWER_UNCONFIRMED, ""
            try:
                if self.networks[axis.bus].switch_off(axis.node_id):
                    continue
            except BusError as error:
                code, why = POWER_UNKNOWN, str(error)
            uncertain.append(Fault(Limit.DRIVE, i, code, drive_source(axis), detail=why))
        return uncertain

    @_as_machine_error
    def explain(self) -> list[Fault]:
        """Return the errors that drives in fault and the safety I/O report now."""
        device, safety = self.device, self._safety
        errors = [] if device is None else reported_errors(self.robot.axes, device, self.networks)
        found = list(errors)
        if safety is not None and (trip := safety.await_trip()):
            found.append(trip)
        return found

    @_as_machine_error
    def read_object(self, axis: int, index: int, sub: int) -> bytes:
        """Return the data of an object of an axis' drive."""
        of = self.robot.axes[axis]
        return self.networks[of.bus].read_bytes(of.node_id, index, sub)

    @_as_machine_error
    def write_object(self, axis: int, index: int, sub: int, value: int) -> None:
        """Write an integer object of an axis' drive."""
        of = self.robot.axes[axis]
        self.networks[of.bus].write(of.node_id, index, sub, value)

    @_as_machine_error
    def close(self) -> str:
        """Switch the drives off and leave the buses; return what remains uncertain."""
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
        """Return the last tensions; None if none are measured."""
        return self._tensions.read()

    def bus_state(self) -> dict[str, Any]:
        """Return the known state of each bus, by its name."""
        return {
            name: {
                "url": str(url),
                "state": "" if (health := self._health(name)) is None else health.text,
                "counts": {} if health is None else health.counts(),
                "drives": self._drives.get(name, {}),
            }
            for name, url in self._urls.items()
        }

    def heartbeat_age_s(self) -> list[float]:
        """Return the time since each drive's last heartbeat, counted in cycles."""
        return [] if self.device is None else self.device.heartbeat_age_s()

    def simulated_status(self) -> dict[str, dict[str, Any]]:
        """Return the status of each simulated bus that is open, by its name."""
        urls = {name: network.url for name, network in self.networks.items()}
        return {name: query_status(url.channel) for name, url in urls.items() if url.is_simulated}

    @property
    def sync_offset(self) -> int:
        """Number of SYNCs that the simulator received before our first cycle."""
        status = next(iter(self.simulated_status().values()), {})
        cycles = 0 if self.device is None else self.device.feedback.cycle
        return int(status.get("sync_count", 0)) - cycles

    def _health(self, bus: str) -> BusHealth | None:
        return self.networks[bus].health if bus in self.networks else None

    def _identities(self) -> dict[str, dict[str, dict[str, int]]]:
        """Return the identities of the booted drives, by bus and axis."""
        drives: dict[str, dict[str, dict[str, int]]] = {}
        for axis, report in zip(self.robot.axes, self.reports, strict=True):
            drives.setdefault(axis.bus, {})[axis.name] = identity_of(report).model_dump()
        return drives

    @property
    def safety(self) -> str:
        """Name of the safety I/O, which also monitors the power; empty without one."""
        return "" if self._safety is None else self._safety.io.name

    @_as_machine_error
    def prepared(self) -> bool:
        """Whether the drives confirm the mode in which they accept torques."""
        return self._booted.mode_confirmed()

    def unprepared(self) -> str:
        """Return which drive does not confirm its mode, and which mode it reports instead."""
        return str(self._booted.unconfirmed_mode())

    @_as_machine_error
    def power_on(self) -> None:
        """Request that all drives switch on their power."""
        self._booted.request(State.OPERATION_ENABLED)

    def power_off(self) -> None:
        """Remove torque and power from all drives with this cycle's command."""
        if self.device is not None:
            self.device.request(State.SWITCH_ON_DISABLED)

    def switch_off_lost(self) -> None:
        """Start to cut the power of drives that do not follow the cycle, without waiting."""
        if self.device is not None:
            self.device.switch_off_lost()

    def quick_stop(self) -> None:
        """Let all drives brake on their own ramp, then switch off, from this cycle's command on."""
        if self.device is not None:
            self.device.request(State.QUICK_STOP)

    def powered(self) -> bool:
        """Whether all drives have power and follow their commands."""
        return self.device is not None and self.device.reached(State.OPERATION_ENABLED)

    def unpowered(self) -> bool:
        """Whether all drives that answer last reported no power.

        A single missing answer does not count: it would cut a quick stop short.
        """
        device = self.device
        if device is None:
            return True
        reported = zip(device.feedback.statusword, device.feedback.alive, strict=True)
        # an axis that has never answered has the state not ready
        return all(state_of(int(word)) in POWER_OFF or not alive for word, alive in reported)

    def reset_faults(self) -> None:
        """Clear latched alarms and let the following cycles reset faults."""
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
        """Release or apply the brakes; does not wait for them."""
        if self._safety is not None and self._safety.braked:
            move = self._safety.io.release_brakes if released else self._safety.io.apply_brakes
            move(*self._safety.braked)

    def brakes_are(self, released: bool) -> bool:
        """Whether the brakes have followed; true without brakes."""
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
        """Return the state that each drive reports, under its name in the standard."""
        if self.device is None:
            return []
        return [
            f"{axis.name} is {state.label}"
            for axis, state in zip(self.robot.axes, self.device.states(), strict=True)
        ]
