"""A simulated servo drive with its motor: CANopen slave, CiA 402 and physics as one bus node."""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path
from typing import Any, Protocol, Self

from typing_extensions import override

from cdpr_profiles.winch import Winch
from cdpr_sim_bus.canopen.abort import Abort, SdoAbort
from cdpr_sim_bus.canopen.node import CanopenSlave
from cdpr_sim_bus.canopen.od import Entry, ObjectDictionary, Value
from cdpr_sim_bus.canopen.slave import NmtState, SlaveApplication
from cdpr_sim_bus.canopen.store import ParameterStore
from cdpr_sim_bus.cia402.axis import Axis, TouchProbes
from cdpr_sim_bus.cia402.drive_quirks import (
    IN_ACCELERATION_UNITS,
    IN_VELOCITY_UNITS,
    DriveQuirks,
    add_missing_objects,
    quirks_of,
)
from cdpr_sim_bus.cia402.faults import FaultInjection
from cdpr_sim_bus.cia402.modes import IN_PLACE, METHODS
from cdpr_sim_bus.cia402.state_machine import StateMachine
from cdpr_sim_bus.cia402.words import ErrorCode
from cdpr_sim_bus.physics_board import BoardAxis
from cdpr_sim_bus.robot import servo
from cdpr_sim_bus.robot.cable_robot import RobotMember
from cdpr_sim_bus.robot.motor_state import MotorRatings, Transmission
from cdpr_sim_bus.robot.plant import Plant
from cdpr_sim_bus.robot.truth_log import NO_SYNC, TruthLog

TICK_S = 1e-3
"""Longest step between two ticks of the state machine."""
_IDLE_STEP_S = 0.1
_LOG_STEP_S = 0.02
"""Bus time without SYNC after which a record is written anyway."""
_SYNC_ID = b"\x80\x00\x00\x00"
_EDS_COUNTS_PER_TURN = 8192
_DEVICE_TYPE, _PROFILE_402, _SERVO_DRIVE = 0x1000, 402, 2

PROCESS_DATA = frozenset(
    {0x6040, 0x6060, 0x6071, 0x607A, 0x60B0, 0x60B1, 0x60B2, 0x60B8, 0x60C1, 0x60FF, 0x2F00}
)
"""Objects that are never stored."""
_CONFIGURATION = (
    *(0x6065, 0x6066, 0x6067, 0x6068, 0x606D, 0x606E, 0x606F, 0x6070),
    *(0x6072, 0x6073, 0x6075, 0x6076, 0x607D, 0x607F, 0x6080),
    *(0x6083, 0x6084, 0x6087, 0x609A, 0x60C5, 0x60C6, 0x60E0, 0x60E1),
)
_FIXED = (0x607E, 0x608F, 0x6091, 0x6092)
_POSITIONS = ((0x6065, 0), (0x6067, 0), (0x6092, 1))


class MotionLog(Protocol):
    """Stores a record at every SYNC, and at intervals without SYNC."""

    def append(self, sync_index: int, time_s: float, truth: tuple[float, ...]) -> None:
        """Append the true values at the end of a `motor.Sample`; `sync_index` may be NO_SYNC."""

    def flush(self) -> None:
        """Write the buffered records."""

    def close(self) -> None:
        """Write the remaining records; nothing follows."""


class SimDrive(SlaveApplication):
    """One simulated drive, a `LocalNode`."""

    def __init__(
        self,
        eds: Path,
        node_id: int,
        plant: Plant,
        ratings: MotorRatings | None = None,
        *,
        truth_log: Path | None = None,
        store: Path | None = None,
        bitrate: int = 1_000_000,
        serial: int | None = None,
        transmission: Transmission | None = None,
        robot: RobotMember | None = None,
    ) -> None:
        """Build the drive, switched on at bus time 0.

        `truth_log` and `store` (memory of 1010h and LSS) are files to write; `serial` is 1018h:4
        if it differs from the EDS; `robot` is the drive's part in a cable robot. Raises
        DictionaryError if the EDS lacks objects, StoreError if the store is damaged, OSError if
        the truth log cannot be created.
        """
        ratings = ratings or MotorRatings()
        self.od = od = ObjectDictionary.from_eds(eds, node_id)
        quirks = quirks_of(od)
        add_missing_objects(od, quirks)
        _adapt(od, quirks, plant, ratings)
        if serial is not None:
            od.set_default(0x1018, 4, serial)
        self._slave = CanopenSlave(
            od, node_id, self, store=ParameterStore(store, PROCESS_DATA), bitrate=bitrate
        )
        self.outbox = self._slave.outbox
        self.axis = Axis(od, plant, ratings, transmission, quirks, robot)
        self.probes = TouchProbes(self.axis)
        self.state_machine = StateMachine(self.axis, self._slave)
        self.fault_injection = FaultInjection(self.state_machine, self._slave)
        self._bind_configuration()
        motor = self.axis.motor
        self._log: MotionLog | None = None
        if truth_log is not None:
            index = float(motor["index"][0]) / float(motor["counts_per_rad"][0])
            self._log = TruthLog(truth_log, node_id, index, float(motor["angle"][0]))
        self._log_due_s = 0.0
        self._board: BoardLink | None = None
        self.sync_count = 0
        """SYNCs seen."""

    @classmethod
    def for_winch(
        cls,
        winch: Winch,
        plant: Plant,
        *,
        truth_log: Path | None = None,
        store: Path | None = None,
        serial: int | None = None,
        robot: RobotMember | None = None,
    ) -> Self:
        """Build the drive of a winch's profile, which also provides values that `plant` omits."""
        motor = winch.motor
        ratings = MotorRatings(
            rated_torque_Nm=motor.rated_torque_Nm,
            peak_torque_Nm=motor.peak_torque_Nm,
            rated_current_Arms=motor.rated_current_Arms,
            peak_current_Arms=motor.peak_current_Arms,
            torque_constant_Nm_per_Arms=motor.torque_constant_Nm_per_Arms,
            rated_speed_rad_s=motor.rated_speed_rad_s,
        )
        return cls(
            winch.drive.eds,
            winch.node_id,
            plant.of(winch),
            ratings,
            truth_log=truth_log,
            store=store,
            bitrate=winch.bitrate_bit_s,
            serial=serial,
            transmission=transmission_of(winch),
            robot=robot,
        )

    def record_with(self, log: MotionLog) -> None:
        """Use `log` instead of a truth log; it is closed together with the drive."""
        self._log = log

    def connect(self, board: BoardAxis) -> None:
        """Share the physics: write the truth to the board, read power and brake from it."""
        self._board = BoardLink(self.axis, self.state_machine, board)
        self.fault_injection.board = board

    # -- LocalNode

    @property
    def node_id(self) -> int:
        """Node id in use."""
        return self._slave.node_id

    @property
    def sync_period_s(self) -> float:
        """Communication cycle period (1006h); 0 while not set."""
        return self._slave.sync_period_s

    @property
    def accepts(self) -> frozenset[int]:
        """Identifiers that the drive receives."""
        return self._slave.accepts

    def advance(self, now: float) -> None:
        """Bring physics, state machine and communication timers to bus time `now`."""
        axis, state_machine = self.axis, self.state_machine
        if self._board is not None:
            self._board.apply_inputs(now)
        while now - axis.time > 1e-9:
            ahead = now - axis.time
            flags = axis.step(now if ahead < 1.5 * TICK_S else axis.time + TICK_S)
            if flags & self.probes.watching:
                self.probes.latch(flags)
            if state_machine.needs_tick(flags):
                state_machine.tick()
        if self._board is not None:
            self._board.publish()
        if self._log is not None and now >= self._log_due_s:
            self._log.append(NO_SYNC, now, axis.sample[4:])
            self._log.flush()
            self._log_due_s = now + _LOG_STEP_S
        self._slave.advance(now)
        if self.fault_injection.active:
            self.fault_injection.alter_outbox(now)

    def prepare(self, until: float) -> None:
        """Compute the first step towards `until` in advance, while the bus waits for its master."""
        time = self.axis.time
        self.axis.prepare(until if until - time < 1.5 * TICK_S else time + TICK_S)

    def receive(self, frame: bytes, now: float) -> None:
        """Process a frame seen on the bus."""
        if frame[:4] == _SYNC_ID:
            if self._log is not None:
                self._log.append(self.sync_count, now, self.axis.sample[4:])
                self._log_due_s = now + _LOG_STEP_S
            self.sync_count += 1
        injection = self.fault_injection
        silent = injection.active and injection.is_silent(now)
        if not silent or injection.ends_silence(frame, self.node_id):
            self._slave.receive(frame, now)
        if self._board is not None:
            self._board.publish_power()
        if self.fault_injection.active:
            self.fault_injection.alter_outbox(now)

    def next_event(self) -> float:
        """Return the latest bus time at which `advance` is due."""
        axis = self.axis
        active = axis.kind != servo.OFF or abs(axis.sample[5]) >= 1e-3
        if active or self.state_machine.needs_tick(axis.flags):
            tick_s = axis.time + TICK_S
        else:
            tick_s = axis.time + _IDLE_STEP_S
        if self._board is not None:
            tick_s = min(tick_s, self._board.next_change_s())
        timer_s = self._slave.timers.next_due
        return timer_s if timer_s < tick_s else tick_s

    def truth(self) -> dict[str, Any]:
        """Return the true state of the drive, its motor and its cable."""
        axis, state_machine = self.axis, self.state_machine
        return {
            "node_id": self.node_id,
            "time_s": axis.time,
            "power_on": axis.kind != servo.OFF,
            "nmt": self._slave.nmt_state.name.lower(),
            "state": state_machine.state.name.lower(),
            "error_code": self.od.get_int(0x603F),
            "angle_rad": axis.read("angle"),
            "velocity_rad_s": axis.read("velocity"),
            "torque_Nm": axis.read("true_gain") * axis.read("current"),
            "brake": "applied" if axis.read("brake") else "released",
            "cable": axis.cable_state,
            "tension_N": axis.read("winch_tension"),
        }

    def close(self) -> None:
        """Flush and close the truth log."""
        self._slave.close()
        if self._log is not None:
            self._log.close()

    # -- callbacks of the slave

    @override
    def after_rpdo(self, now: float) -> None:
        """Apply the set-points of a new cycle."""
        self.state_machine.sync()

    @override
    def on_nmt(self, state: NmtState) -> None:
        """React to the loss of control by the master."""
        left = state is NmtState.PRE_OPERATIONAL and self.axis.plant.drive.off_when_pre_operational
        if left or state in (NmtState.STOPPED, NmtState.INITIALISING):
            self.state_machine.abort_connection(ErrorCode.COMMUNICATION)

    @override
    def on_reset_node(self) -> None:
        """Reboot: the rotor does not move, the counter starts again."""
        self.fault_injection.reset()
        self.probes.reset()
        self.state_machine.restart()

    @override
    def on_heartbeat_lost(self, node: int) -> None:
        """React to a silent master as 6007h specifies."""
        self.state_machine.abort_connection(ErrorCode.HEARTBEAT)

    @override
    def on_rpdo_timeout(self, number: int) -> None:
        """React to missing commands as 6007h specifies."""
        self.state_machine.abort_connection(ErrorCode.RPDO_TIMEOUT)

    # -- objects

    def _bind_configuration(self) -> None:
        for entry in self.od:
            if entry.index in _CONFIGURATION and entry.writable:
                entry.hook = self._change_noter(entry)
            elif entry.index in _FIXED and entry.writable:
                entry.hook = _fixed(entry)
        known = self.axis.quirks.homing_methods or frozenset(METHODS) | IN_PLACE
        self.od.on_write(0x6098, 0, _only(lambda value: value in known))

    def _change_noter(self, entry: Entry) -> Callable[[Value], None]:
        def note(value: Value) -> None:
            if value != entry.value:
                self.state_machine.configuration_changed = True

        return note


def transmission_of(winch: Winch) -> Transmission:
    """Return the transmission from a winch's motor to its cable, from its profile."""
    cable = winch.cable
    return Transmission(
        winch.cable_m_per_motor_rad, cable.stiffness_N, winch.gear_ratio, cable.damping_s
    )


def _only(allowed: Callable[[Any], bool]) -> Callable[[Value], None]:
    def check(value: Value) -> None:
        if not allowed(value):
            raise SdoAbort(Abort.INVALID_VALUE)

    return check


def _fixed(entry: Entry) -> Callable[[Value], None]:
    return _only(lambda value: value == entry.value)


def _adapt(od: ObjectDictionary, quirks: DriveQuirks, plant: Plant, ratings: MotorRatings) -> None:
    """Set the defaults of the dictionary that follow from the device, its motor and encoder."""
    counts = plant.encoder.counts_per_turn
    if od.get_int(_DEVICE_TYPE) & 0xFFFF != _PROFILE_402:  # an error of the file, not of the drive
        od.set_default(_DEVICE_TYPE, 0, _SERVO_DRIVE << 16 | _PROFILE_402)
    rates = () if quirks.velocity_in_rpm else IN_VELOCITY_UNITS + IN_ACCELERATION_UNITS
    for index, sub in (*_POSITIONS, *rates):
        entry = od.entry(index, sub)
        scaled = max(1, round(od.get_int(index, sub) * counts / _EDS_COUNTS_PER_TURN))
        _default(entry, min(scaled, entry.codec.high or scaled))
    _default(od.entry(0x608F, 1), counts)
    _default(od.entry(0x6075), round(ratings.rated_current_Arms * 1e3))
    _default(od.entry(0x6076), round(ratings.rated_torque_Nm / quirks.rated_torque_unit_Nm))
    unit = quirks.unit_Nm(ratings.rated_torque_Nm, ratings.torque_constant_Nm_per_Arms)
    for index in (0x6072, 0x60E0, 0x60E1):
        _default(od.entry(index), min(round(ratings.peak_torque_Nm / unit), 0xFFFF))
    _default(od.entry(0x6073), round(1e3 * ratings.peak_current_Arms / ratings.rated_current_Arms))
    _default(od.entry(0x6080), round(ratings.rated_speed_rad_s * 60.0 / (2.0 * math.pi)))


def _default(entry: Entry, value: int) -> None:
    entry.base_default = entry.default = entry.value = value


class BoardLink:
    """Publishes one drive's true state on the board and applies other devices' inputs."""

    def __init__(self, axis: Axis, state_machine: StateMachine, board: BoardAxis) -> None:
        self._axis = axis
        self._state_machine = state_machine
        self._board = board
        self._tension = axis.motor["winch_tension"]
        self._power_on = False
        self._applied_s = axis.time
        self._mass_kg = axis.read("mass")
        board.hung_mass_kg = self._mass_kg
        self.publish()

    def apply_inputs(self, now_s: float) -> None:
        """Apply power, brake and mass from the board at bus time `now_s`."""
        board = self._board
        self._applied_s = now_s
        power, applied = board.allows_power(now_s), not board.releases_brake(now_s)
        if power != self._state_machine.power_input:
            self._state_machine.allow_power(power)
        if applied != self._axis.brake_applied:
            self._axis.brake_applied = applied
            self._axis.update_brake()
        if board.hung_mass_kg != self._mass_kg:
            self._mass_kg = board.hung_mass_kg
            self._axis.motor["mass"] = self._mass_kg

    def next_change_s(self) -> float:
        """Return the next bus time at which power or brake change."""
        return self._board.next_change_s(self._applied_s)

    def publish(self) -> None:
        """Write the present tension and motion."""
        axis = self._axis
        angle, speed = axis.sample[4], axis.sample[5]
        self._power_on = axis.kind != servo.OFF
        shown_N = float(self._tension[0]) + axis.cell_off_N
        self._board.publish(axis.time, shown_N, angle, speed, self._power_on)

    def publish_power(self) -> None:
        """Publish a change of power now, because bus time may then stand still for long."""
        if self._power_on != (self._axis.kind != servo.OFF):
            self.publish()
