"""A rail on a positioning drive with Modbus TCP."""

from __future__ import annotations

from typing import Final

from cdpr_drivers.modbus.safety_io import SafetyIo
from cdpr_drivers.modbus.tcp import ModbusTcp
from cdpr_drivers.rails.rail import RailError
from cdpr_profiles.devices.rail import RailProfile
from cdpr_rt.core.clock import Clock

_LOOK_S: Final = 0.01
_ENABLE_S: Final = 2.0
_STOP_S: Final = 5.0


class ModbusRailAxis:
    """The axis of a rail of kind "modbus"; implements `cdpr_drivers.rails.rail.RailAxis`.

    Methods raise RailError and ModbusError. Every request feeds the drive's watchdog, so that it
    stops and brakes by itself once nobody asks any more. Trips of `safety`, if there is one, end
    the move.
    """

    def __init__(self, rail: RailProfile, clock: Clock, safety: SafetyIo | None = None) -> None:
        assert rail.modbus is not None  # its kind says so
        self._clock, self._safety = clock, safety
        self._rail, self._map = rail, rail.modbus
        there = self._map
        self._client = ModbusTcp(there.host, there.port, there.unit, there.answer_timeout_s, clock)
        self._command = self._count = 0

    def open(self) -> None:
        """Connect, and set the drive's watchdog; nothing moves.

        Raises RailError for a drive that somebody else has enabled.
        """
        watchdog = self._map.watchdog
        if watchdog is not None and watchdog.timeout_register is not None:
            units = round(watchdog.timeout_s / watchdog.timeout_unit_s)
            self._client.write_registers(watchdog.timeout_register, [units])
        if self._is(self._map.status.enabled):
            raise RailError(
                f"{self._rail.name}: the drive is enabled already: another command moves it, or "
                "has died (its watchdog takes the power then; otherwise switch it off)"
            )

    def close(self) -> None:
        """Leave the drive."""
        self._client.close()

    def check(self) -> None:
        """Raise RailError when the drive has a fault, or the safety I/O has tripped."""
        if self._safety is not None:
            tripped = self._safety.alarm() or self._safety.stop_reason()
            if tripped:
                raise RailError(f"{self._rail.name}: {tripped}")
        if self._is(self._map.status.fault):
            raise RailError(f"{self._rail.name}: the drive is in fault (its status register)")

    def brake_released(self) -> bool:
        """Return what the brake's feedback says."""
        return self._is(self._map.status.brake_released)

    def position_m(self) -> float:
        """Return where the carriage is."""
        self._feed()
        high, low = self._client.registers(self._map.position_register, 2)
        counts = high << 16 | low
        return (counts - (1 << 32 if counts >> 31 else 0)) * self._map.metre_per_unit

    def enable(self) -> None:
        """Switch the power stage on."""
        self._write(self._command | 1 << self._map.command.enable)
        self._await(self._map.status.enabled, True, _ENABLE_S, "is not enabled")

    def disable(self) -> None:
        """Take the power away, and every command with it but the brake's, which stays applied."""
        self._write(0)
        self.push(0.0)
        self._await(self._map.status.enabled, False, _ENABLE_S, "does not give its power up")

    def push(self, share: float) -> bool:
        """Push with a share of the rated torque where the drive can."""
        register = self._map.push_register
        if register is None:
            return False
        if share and not self._command >> self._map.command.enable & 1:
            self.enable()
        self._client.write_registers(register, [round(100.0 * share) & 0xFFFF])
        return True

    def start(self, target_m: float) -> None:
        """Begin to move to a position."""
        unit, command = self._map.metre_per_unit, self._map.command
        counts = round(target_m / unit) & 0xFFFFFFFF
        self._set(self._map.target_register, [counts >> 16, counts & 0xFFFF])
        self._set(self._map.speed_register, [min(round(self._rail.speed_m_s / unit), 0xFFFF)])
        self._write(self._command & ~(1 << command.start | 1 << command.halt))
        self._write(self._command | 1 << command.start)

    def arrived(self) -> bool:
        """Return whether the drive says so, and stands still."""
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
        text = f"the brake is not {wanted} {timeout_s:g} s after it was told to"
        self._await(self._map.status.brake_released, released, timeout_s, text)

    def _set(self, register: int, values: list[int]) -> None:
        """Write what a move goes by, and read it back."""
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
