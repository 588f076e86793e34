"""A rail on a CiA 402 drive in profile position mode, by SDO alone."""

from __future__ import annotations

import math
from typing import Final

from cdpr_drivers.canopen.boot.boot import BootReport
from cdpr_drivers.canopen.network import CanNetwork
from cdpr_drivers.cia402 import (
    CONTROLWORD_TABLE,
    FAULT_RESET,
    HALT,
    POWER_OFF,
    Mode,
    State,
    fault_text,
    state_of,
)
from cdpr_drivers.drive_units import acceleration_unit_rad_s2, torque_unit_Nm, velocity_unit_rad_s
from cdpr_drivers.modbus.safety_io import SafetyIo
from cdpr_drivers.rails.rail import RailError
from cdpr_profiles import DriveProfile
from cdpr_profiles.devices.rail import RailProfile

_LOOK_S: Final = 0.01
_STOP_S: Final = 5.0
_ENABLED: Final = 0x0F
_NEW_SET_POINT, _AT_ONCE = 1 << 4, 1 << 5
_TARGET_REACHED, _ACKNOWLEDGE, _FOLLOWING_ERROR = 1 << 10, 1 << 12, 1 << 13


class Cia402RailAxis:
    """The axis of a rail of kind "cia402", booted; implements `cdpr_drivers.rails.rail.RailAxis`.

    Its brake is an axis of the safety I/O, whose trips end the move. Methods raise RailError,
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
        assert rail.cia402 is not None  # its kind says so
        self._rail, self._drive, self._network, self._safety = rail, drive, network, safety
        self._map = rail.cia402
        self._node = self._map.node_id
        self._turn = report.counts_per_turn
        sign = self._map.direction * drive.position_sign
        self._m_per_count = sign * self._map.travel_per_turn_m / self._turn
        self._push_unit = torque_unit_Nm(drive, report.rated_torque_Nm)
        self._rated_Nm = report.rated_torque_Nm
        self._clock = network.clock
        self._pushing = False

    def check(self) -> None:
        """Raise when the drive has a fault or was lost, or the safety I/O has tripped."""
        tripped = self._safety.alarm() or self._safety.stop_reason() or self._network.alarm_text
        if tripped:
            raise RailError(f"{self._rail.name}: {tripped}")
        state = state_of(self._statusword())
        if state in (State.FAULT, State.FAULT_REACTION):
            code = fault_text(self._network.read_int(self._node, 0x603F))
            raise RailError(f"{self._rail.name}: node {self._node} is in fault: {code}")

    def position_m(self) -> float:
        """Return where the carriage is, from 6064h."""
        counts = self._network.read_int(self._node, 0x6064)
        return (counts - self._map.zero_counts) * self._m_per_count

    def enable(self) -> None:
        """Switch the power stage on in profile position mode; its set-point is where it stands."""
        self._prepare(Mode.PROFILE_POSITION)
        speed, ramp = self._profile()
        self._write(0x6081, speed)
        self._write(0x6083, ramp)
        self._write(0x6084, ramp)
        self._write(0x607A, self._network.read_int(self._node, 0x6064))
        self._reach_state(State.OPERATION_ENABLED)

    def disable(self) -> None:
        """Take the power away; a drive in fault has none."""
        self._pushing = False
        if state_of(self._statusword()) not in (State.FAULT, State.FAULT_REACTION):
            self._reach_state(State.SWITCH_ON_DISABLED)

    def push(self, share: float) -> bool:
        """Push with a share of the rated torque in profile torque mode."""
        if Mode.PROFILE_TORQUE not in self._drive.supported_modes:
            return False
        if share and not self._pushing:
            self._prepare(Mode.PROFILE_TORQUE)
            self._write(0x6071, 0)
            self._reach_state(State.OPERATION_ENABLED)
            self._pushing = True
        limit = min(abs(share) * self._rated_Nm, self._map.torque_limit_Nm)
        self._write(0x6071, round(math.copysign(limit, share) / self._push_unit))
        if not share and self._pushing:
            self.disable()
        return True

    def start(self, target_m: float) -> None:
        """Give a new set-point by the handshake of bits 4 (controlword) and 12 (statusword)."""
        counts = round(target_m / self._m_per_count) + self._map.zero_counts
        self._write(0x607A, counts)
        self._write(0x6040, _ENABLED | _AT_ONCE | _NEW_SET_POINT)
        self._await_bit(_ACKNOWLEDGE, True, "does not acknowledge the set-point")
        self._write(0x6040, _ENABLED)
        self._await_bit(_ACKNOWLEDGE, False, "does not take its acknowledgement back")

    def arrived(self) -> bool:
        """Return whether the drive says target reached; raises RailError for one left behind."""
        word = self._statusword()
        if state_of(word) != State.OPERATION_ENABLED:
            raise self._wrong(f"left operation enabled and is {state_of(word).label}")
        if word & _FOLLOWING_ERROR:
            raise self._wrong("reports a following error")
        return bool(word & _TARGET_REACHED)

    def halt(self) -> None:
        """Stop on the profile's ramp (605Dh) and wait until it stands, or has no power any more."""
        self._write(0x6040, _ENABLED | HALT)
        deadline = self._clock.now_s + _STOP_S
        while not (word := self._statusword()) & _TARGET_REACHED:
            if state_of(word) != State.OPERATION_ENABLED:
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
        """Reset the drive's fault by the rising edge of bit 7; nothing is enabled by it."""
        self._write(0x6040, 0)
        self._write(0x6040, FAULT_RESET)
        self._write(0x6040, 0)
        self._reach_state(State.SWITCH_ON_DISABLED)

    def _profile(self) -> tuple[int, int]:
        """Return profile velocity and acceleration in the drive's units."""
        rad_per_m = math.tau / self._map.travel_per_turn_m
        speed = self._rail.speed_m_s * rad_per_m / velocity_unit_rad_s(self._drive, self._turn)
        unit = acceleration_unit_rad_s2(self._drive, self._turn)
        return max(1, round(speed)), max(1, round(self._rail.acceleration_m_s2 * rad_per_m / unit))

    def _prepare(self, mode: Mode) -> None:
        """Have the drive without power in a mode that it confirms."""
        if state_of(self._statusword()) not in POWER_OFF:
            self._reach_state(State.SWITCH_ON_DISABLED)
        self._write(0x6060, mode)
        deadline = self._clock.now_s + self._drive.mode_display_timeout_s
        while (shown := self._network.read_int(self._node, 0x6061)) != mode:
            if self._clock.now_s > deadline:
                raise self._wrong(f"shows mode {shown} (6061h) and not {int(mode)}")
            self._clock.sleep(_LOOK_S)

    def _reach_state(self, target: State) -> None:
        deadline = self._clock.now_s + 4.0 * self._drive.state_timeout_s
        while True:
            state = state_of(self._statusword())
            if state == target:
                return
            if self._clock.now_s > deadline or state == State.FAULT:
                code = fault_text(self._network.read_int(self._node, 0x603F))
                raise self._wrong(f"is {state.label}, not {target.label} ({code})")
            self._write(0x6040, int(CONTROLWORD_TABLE[target, state]))
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
