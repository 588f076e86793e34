"""Move a rail: require slack cables and a brake, invalidate the calibration, brake at the end."""

from __future__ import annotations

import contextlib
import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Final

from cdpr_drivers import cia402
from cdpr_drivers.canopen.boot import BootReport
from cdpr_drivers.canopen.network import CanNetwork
from cdpr_drivers.drive_units import acceleration_unit_rad_s2, torque_unit_Nm, velocity_unit_rad_s
from cdpr_drivers.errors import DriverError
from cdpr_drivers.modbus.channel import ModbusTcp
from cdpr_drivers.modbus.safety_io import SafetyIo
from cdpr_profiles import DriveProfile
from cdpr_profiles.rail import RailProfile
from cdpr_rt.core.clock import Clock
from cdpr_rt.model.calibration_state import mark_not_calibrated

_LOOK_S: Final = 0.01
_SETTLE_S: Final = 0.3
_EXTRA_TIME_S: Final = 3.0
"""Time that a move may take in addition to twice its nominal time."""
_VOIDED: Final = "; the robot is no longer calibrated"


class RailError(DriverError):
    """A rail did not move, or not to its target; the message says why."""


class RailStoppedError(RailError):
    """The operator requested a stop; the rail was stopped and braked."""


@dataclass(frozen=True)
class MoveResult:
    """Result of a move."""

    from_m: float
    to_m: float
    brake_moved_m: float | None
    """Movement under a push against the applied brake; None if the drive cannot push."""


@dataclass(frozen=True)
class MoveConditions:
    """What must hold before and during a move."""

    cables_tight: Callable[[], str]
    """Returns why the cables do not count as slack, or an empty text."""
    powered: Callable[[], str]
    """Returns which winch has power, or an empty text."""
    stop_requested: Callable[[], bool]
    progress: Callable[[float], None]
    """Called with the position in m."""


def move(
    rail: RailProfile, axis: RailAxis, clock: Clock, target_m: float, conditions: MoveConditions
) -> MoveResult:
    """Move the rail to `target_m`; however the move ends, the axis is braked and without power.

    The robot is marked as not calibrated before the carriage moves. Raises RailError for tight
    cables, winches with power, a brake that does not hold, a target beyond the travel or a move
    that does not arrive. Raises RailStoppedError if a stop was requested, StateFileError, and the
    errors of the axis.
    """
    if not rail.travel_min_m <= target_m <= rail.travel_max_m:
        raise RailError(
            f"{rail.name}: target {target_m:g} m; allowed: {rail.travel_min_m:g} to "
            f"{rail.travel_max_m:g} m"
        )
    _refuse(rail, conditions)
    axis.check()
    start_m = axis.position_m()
    try:
        axis.set_brake(False)
        pushed_m = _test_brake(rail, axis, clock)
        _stop_on_request(rail, conditions, voided="")
        _void_calibration(rail, clock, f"{rail.name} was moved from {start_m:.4f} m")
        _refuse(rail, conditions, voided=_VOIDED)  # the write to disk may have been slow
        axis.check()
        _stop_on_request(rail, conditions)
        axis.enable()
        axis.set_brake(True)
        try:
            axis.start(target_m)
            _follow(rail, axis, clock, abs(target_m - start_m), conditions)
        except BaseException:
            with contextlib.suppress(DriverError):
                axis.halt()
            raise
    finally:
        _hold(axis, clock)
    end_m = axis.position_m()
    if abs(end_m - target_m) > rail.tolerance_m:
        raise RailError(
            f"{rail.name}: stands at {end_m:.4f} m with the brake applied, but the target "
            f"is {target_m:.4f} m ({rail.tolerance_m:g} m allowed): does the brake hold?"
        )
    return MoveResult(start_m, end_m, pushed_m)


def _void_calibration(rail: RailProfile, clock: Clock, why: str) -> None:
    """Write the mark to disk, which may take a second; keep the drive's heartbeat alive."""
    clock.run_blocking(lambda: mark_not_calibrated(rail.robot, why))


def _refuse(rail: RailProfile, conditions: MoveConditions, voided: str = "") -> None:
    if tight := conditions.cables_tight():
        raise RailError(f"{rail.name}: moves only with slack cables: {tight}{voided}")
    if powered := conditions.powered():
        raise RailError(f"{rail.name}: moves only without power at the winches: {powered}{voided}")


def _stop_on_request(rail: RailProfile, conditions: MoveConditions, voided: str = _VOIDED) -> None:
    if conditions.stop_requested():
        raise RailStoppedError(f"{rail.name}: stopped on request{voided}")


def _test_brake(rail: RailProfile, axis: RailAxis, clock: Clock) -> float | None:
    """Push both ways against the applied brake; return the movement, None if it cannot push."""
    check = rail.brake_check
    before, moved = axis.position_m(), 0.0
    for way in (1.0, -1.0):
        if not axis.push(way * check.torque_percent / 100.0):
            return None
        deadline = clock.now_s + check.seconds
        over = False
        while not over:
            over = clock.now_s >= deadline  # the last check comes after the deadline, however late
            moved = max(moved, abs(axis.position_m() - before))
            if moved > check.allowed_m:
                break
            clock.sleep(_LOOK_S)
    axis.push(0.0)
    if moved > check.allowed_m:
        _void_calibration(rail, clock, f"{rail.name} slipped by {moved * 1e3:.2f} mm on its brake")
        raise RailError(
            f"{rail.name}: the applied brake does not hold: with {check.torque_percent:g} % of "
            f"the rated torque, the carriage moved {moved * 1e3:.2f} mm "
            f"({check.allowed_m * 1e3:g} mm allowed)"
        )
    return moved


def _follow(
    rail: RailProfile, axis: RailAxis, clock: Clock, distance_m: float, conditions: MoveConditions
) -> None:
    nominal_s = distance_m / rail.speed_m_s + rail.speed_m_s / rail.acceleration_m_s2
    allowed_s = 2.0 * nominal_s + _EXTRA_TIME_S
    began = clock.now_s
    while not axis.arrived():
        axis.check()
        conditions.progress(axis.position_m())
        _stop_on_request(rail, conditions)
        cables_tight = conditions.cables_tight()
        if cables_tight:
            raise RailError(
                f"{rail.name}: stopped, because the cables are no longer slack: {cables_tight}"
            )
        powered = conditions.powered()
        if powered:
            raise RailError(f"{rail.name}: stopped, because a winch may have power: {powered}")
        if clock.now_s - began > allowed_s:
            raise RailError(f"{rail.name}: did not arrive within {allowed_s:.1f} s")
        clock.sleep(_LOOK_S)


def _hold(axis: RailAxis, clock: Clock) -> None:
    """Apply the brake before the drive loses torque; cut the power even if the brake fails."""
    try:
        axis.set_brake(False)
    finally:
        axis.disable()
    clock.sleep(_SETTLE_S)  # in this time, a slipping brake becomes visible


# A rail on a CiA 402 drive in profile position mode, by SDO alone.

_STOP_S: Final = 5.0
_ENABLED: Final = 0x0F
_NEW_SET_POINT, _AT_ONCE = 1 << 4, 1 << 5
_TARGET_REACHED, _ACKNOWLEDGE, _FOLLOWING_ERROR = 1 << 10, 1 << 12, 1 << 13


class Cia402RailAxis:
    """The axis of a rail of kind "cia402", booted.

    The safety I/O controls its brake, and its trips end the move. Methods raise RailError,
    SafetyIoError, SdoError and BusError.
    """

    def __init__(
        self,
        rail: RailProfile,
        drive: DriveProfile,
        network: CanNetwork,
        report: BootReport,
        safety: SafetyIo,
    ) -> None:
        assert rail.cia402 is not None  # guaranteed by its kind
        self._rail, self._drive, self._network, self._safety = rail, drive, network, safety
        self._map = rail.cia402
        self._node = self._map.node_id
        self._turn = report.counts_per_turn
        sign = self._map.direction * drive.position_sign
        self._m_per_count = sign * self._map.travel_per_turn_m / self._turn
        self._push_unit = torque_unit_Nm(
            drive, report.rated_torque_Nm, report.torque_constant_Nm_per_Arms
        )
        self._rated_Nm = report.rated_torque_Nm
        self._clock = network.clock
        self._pushing = False

    def check(self) -> None:
        """Raise an error if the drive has a fault or was lost, or the safety I/O has tripped."""
        tripped = self._safety.alarm() or self._safety.stop_reason() or self._network.alarm_text
        if tripped:
            raise RailError(f"{self._rail.name}: {tripped}")
        state = cia402.state_of(self._statusword())
        if state in (cia402.State.FAULT, cia402.State.FAULT_REACTION):
            code = cia402.fault_text(self._network.read_int(self._node, 0x603F))
            raise RailError(f"{self._rail.name}: node {self._node} is in fault: {code}")

    def position_m(self) -> float:
        """Return the position of the carriage, from 6064h."""
        counts = self._network.read_int(self._node, 0x6064)
        return (counts - self._map.zero_counts) * self._m_per_count

    def enable(self) -> None:
        """Switch on in profile position mode, with the present position as set-point."""
        self._prepare(cia402.Mode.PROFILE_POSITION)
        speed, ramp = self._profile()
        self._write(0x6081, speed)
        self._write(0x6083, ramp)
        self._write(0x6084, ramp)
        self._write(0x607A, self._network.read_int(self._node, 0x6064))
        self._reach_state(cia402.State.OPERATION_ENABLED)

    def disable(self) -> None:
        """Cut the power; a drive in fault has none."""
        self._pushing = False
        if cia402.state_of(self._statusword()) not in (
            cia402.State.FAULT,
            cia402.State.FAULT_REACTION,
        ):
            self._reach_state(cia402.State.SWITCH_ON_DISABLED)

    def push(self, share: float) -> bool:
        """Push with a share of the rated torque in profile torque mode."""
        if cia402.Mode.PROFILE_TORQUE not in self._drive.supported_modes:
            return False
        if share and not self._pushing:
            self._prepare(cia402.Mode.PROFILE_TORQUE)
            self._write(0x6071, 0)
            self._reach_state(cia402.State.OPERATION_ENABLED)
            self._pushing = True
        limit = min(abs(share) * self._rated_Nm, self._map.torque_limit_Nm)
        self._write(0x6071, round(math.copysign(limit, share) / self._push_unit))
        if not share and self._pushing:
            self.disable()
        return True

    def start(self, target_m: float) -> None:
        """Send a new set-point with the handshake of bits 4 (controlword) and 12 (statusword)."""
        counts = round(target_m / self._m_per_count) + self._map.zero_counts
        self._write(0x607A, counts)
        self._write(0x6040, _ENABLED | _AT_ONCE | _NEW_SET_POINT)
        self._await_bit(_ACKNOWLEDGE, True, "does not acknowledge the set-point")
        self._write(0x6040, _ENABLED)
        self._await_bit(_ACKNOWLEDGE, False, "does not clear its acknowledgement")

    def arrived(self) -> bool:
        """Return whether the target is reached; raises RailError if the drive lags or is off."""
        word = self._statusword()
        if cia402.state_of(word) != cia402.State.OPERATION_ENABLED:
            raise self._wrong(
                f"left state operation enabled; it is in state {cia402.state_of(word).label}"
            )
        if word & _FOLLOWING_ERROR:
            raise self._wrong("reports a following error")
        return bool(word & _TARGET_REACHED)

    def halt(self) -> None:
        """Stop on the profile's ramp (605Dh) and wait for standstill or loss of power."""
        self._write(0x6040, _ENABLED | cia402.HALT)
        deadline = self._clock.now_s + _STOP_S
        while not (word := self._statusword()) & _TARGET_REACHED:
            if cia402.state_of(word) != cia402.State.OPERATION_ENABLED:
                return
            if self._clock.now_s > deadline:
                raise self._wrong("does not stop")
            self._clock.sleep(_LOOK_S)

    def set_brake(self, released: bool) -> None:
        """Release or apply the brake at the safety I/O, and wait for its feedback."""
        axis = self._map.brake_axis
        (self._safety.release_brakes if released else self._safety.apply_brakes)(axis)
        self._safety.await_brakes(released, axis)

    def acknowledge_fault(self) -> None:
        """Reset the drive's fault by the rising edge of bit 7; this enables nothing."""
        self._write(0x6040, 0)
        self._write(0x6040, cia402.FAULT_RESET)
        self._write(0x6040, 0)
        self._reach_state(cia402.State.SWITCH_ON_DISABLED)

    def _profile(self) -> tuple[int, int]:
        """Return profile velocity and acceleration in the drive's units."""
        rad_per_m = math.tau / self._map.travel_per_turn_m
        speed = self._rail.speed_m_s * rad_per_m / velocity_unit_rad_s(self._drive, self._turn)
        unit = acceleration_unit_rad_s2(self._drive, self._turn)
        return max(1, round(speed)), max(1, round(self._rail.acceleration_m_s2 * rad_per_m / unit))

    def _prepare(self, mode: cia402.Mode) -> None:
        """Bring the drive without power into a mode that it confirms."""
        if cia402.state_of(self._statusword()) not in cia402.POWER_OFF:
            self._reach_state(cia402.State.SWITCH_ON_DISABLED)
        self._write(0x6060, mode)
        deadline = self._clock.now_s + self._drive.mode_display_timeout_s
        while (shown := self._network.read_int(self._node, 0x6061)) != mode:
            if self._clock.now_s > deadline:
                raise self._wrong(f"shows mode {shown} (6061h) instead of {int(mode)}")
            self._clock.sleep(_LOOK_S)

    def _reach_state(self, target: cia402.State) -> None:
        deadline = self._clock.now_s + 4.0 * self._drive.state_timeout_s
        while True:
            state = cia402.state_of(self._statusword())
            if state == target:
                return
            if self._clock.now_s > deadline or state == cia402.State.FAULT:
                code = cia402.fault_text(self._network.read_int(self._node, 0x603F))
                raise self._wrong(f"is in state {state.label} instead of {target.label} ({code})")
            self._write(0x6040, int(cia402.CONTROLWORD_TABLE[target, state]))
            self._clock.sleep(_LOOK_S)

    def _await_bit(self, bit: int, expected: bool, problem: str) -> None:
        deadline = self._clock.now_s + self._drive.state_timeout_s
        while bool(self._statusword() & bit) != expected:
            if self._clock.now_s > deadline:
                raise self._wrong(problem)
            self._clock.sleep(_LOOK_S)

    def _statusword(self) -> int:
        return self._network.read_int(self._node, 0x6041)

    def _write(self, index: int, value: int) -> None:
        self._network.write(self._node, index, 0, value)

    def _wrong(self, problem: str) -> RailError:
        return RailError(f"{self._rail.name}: node {self._node} {problem}")


# A rail on a positioning drive with Modbus TCP.

_ENABLE_S: Final = 2.0


class ModbusRailAxis:
    """The axis of a rail of kind "modbus".

    Methods raise RailError and ModbusError. Every request feeds the drive's watchdog, so that the
    drive stops and brakes when requests end. A trip of `safety`, if there is one, ends the move.
    """

    def __init__(self, rail: RailProfile, clock: Clock, safety: SafetyIo | None = None) -> None:
        assert rail.modbus is not None  # guaranteed by its kind
        self._clock, self._safety = clock, safety
        self._rail, self._map = rail, rail.modbus
        there = self._map
        self._client = ModbusTcp(there.host, there.port, there.unit, there.answer_timeout_s, clock)
        self._command = self._count = 0

    def open(self) -> None:
        """Connect, and set the drive's watchdog; nothing moves.

        Raises RailError if another client has enabled the drive.
        """
        watchdog = self._map.watchdog
        if watchdog is not None and watchdog.timeout_register is not None:
            units = round(watchdog.timeout_s / watchdog.timeout_unit_s)
            self._client.write_registers(watchdog.timeout_register, [units])
        if self._is(self._map.status.enabled):
            raise RailError(
                f"{self._rail.name}: the drive is already enabled: wait until the command "
                "that moves it ends; if that command has died, wait for the drive's watchdog, or "
                "switch the drive off"
            )

    def close(self) -> None:
        """Disconnect from the drive."""
        self._client.close()

    def check(self) -> None:
        """Raise RailError if the drive has a fault, or the safety I/O has tripped."""
        if self._safety is not None:
            tripped = self._safety.alarm() or self._safety.stop_reason()
            if tripped:
                raise RailError(f"{self._rail.name}: {tripped}")
        if self._is(self._map.status.fault):
            raise RailError(f"{self._rail.name}: the drive is in fault (its status register)")

    def brake_released(self) -> bool:
        """Return the brake's feedback."""
        return self._is(self._map.status.brake_released)

    def position_m(self) -> float:
        """Return the position of the carriage."""
        self._feed()
        high, low = self._client.registers(self._map.position_register, 2)
        counts = high << 16 | low
        return (counts - (1 << 32 if counts >> 31 else 0)) * self._map.metre_per_unit

    def enable(self) -> None:
        """Switch the power stage on."""
        self._write(self._command | 1 << self._map.command.enable)
        self._await(self._map.status.enabled, True, _ENABLE_S, "is not enabled")

    def disable(self) -> None:
        """Cut the power and clear every command except the brake's, which stays applied."""
        self._write(0)
        self.push(0.0)
        self._await(self._map.status.enabled, False, _ENABLE_S, "does not switch its power off")

    def push(self, share: float) -> bool:
        """Push with a share of the rated torque if the drive can."""
        register = self._map.push_register
        if register is None:
            return False
        if share and not self._command >> self._map.command.enable & 1:
            self.enable()
        self._client.write_registers(register, [round(100.0 * share) & 0xFFFF])
        return True

    def start(self, target_m: float) -> None:
        """Start to move to a position."""
        unit, command = self._map.metre_per_unit, self._map.command
        counts = round(target_m / unit) & 0xFFFFFFFF
        self._set(self._map.target_register, [counts >> 16, counts & 0xFFFF])
        self._set(self._map.speed_register, [min(round(self._rail.speed_m_s / unit), 0xFFFF)])
        self._write(self._command & ~(1 << command.start | 1 << command.halt))
        self._write(self._command | 1 << command.start)

    def arrived(self) -> bool:
        """Return whether the drive reports arrival and stands still."""
        status, bits = self._status(), self._map.status
        return bool(status >> bits.in_position & 1) and not status >> bits.moving & 1

    def halt(self) -> None:
        """Stop on the drive's ramp."""
        self._write((self._command | 1 << self._map.command.halt) & ~(1 << self._map.command.start))
        self._await(self._map.status.moving, False, _STOP_S, "does not stop")

    def set_brake(self, released: bool) -> None:
        """Release or apply the brake, and wait for its feedback."""
        bit = 1 << self._map.command.release_brake
        self._write(self._command | bit if released else self._command & ~bit)
        wanted = "released" if released else "applied"
        timeout_s = self._map.brake_timeout_s
        text = f"the brake is not {wanted} {timeout_s:g} s after the command"
        self._await(self._map.status.brake_released, released, timeout_s, text)

    def _set(self, register: int, values: list[int]) -> None:
        """Write parameters of a move and read them back."""
        self._client.write_registers(register, values)
        held = self._client.registers(register, len(values))
        if held != values:
            raise RailError(
                f"{self._rail.name}: holding register {register} was set to {values} and reads "
                f"{held}; the drive was not started"
            )

    def _write(self, command: int) -> None:
        self._feed()
        self._client.write_registers(self._map.command_register, [command])
        self._command = command

    def _is(self, bit: int) -> bool:
        return bool(self._status() >> bit & 1)

    def _status(self) -> int:
        self._feed()
        return self._client.registers(self._map.status_register, 1)[0]

    def _feed(self) -> None:
        watchdog = self._map.watchdog
        if watchdog is not None and watchdog.trigger_register is not None:
            self._count = (self._count + 1) & 0xFFFF
            self._client.write_registers(watchdog.trigger_register, [self._count])

    def _await(self, bit: int, expected: bool, timeout_s: float, problem: str) -> None:
        clock = self._clock
        deadline_s = clock.now_s + timeout_s
        while self._is(bit) != expected:
            if clock.now_s > deadline_s:
                status = self._map.status_register
                raise RailError(f"{self._rail.name}: {problem} (status register {status})")
            clock.sleep(_LOOK_S)


RailAxis = Cia402RailAxis | ModbusRailAxis
"""One position axis with a holding brake; methods raise DriverError."""
