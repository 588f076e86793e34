"""Reads and writes of a safety I/O as its profile lays them out, one request for each image."""

from __future__ import annotations

from collections.abc import Iterable

from cdpr_drivers.modbus.io_rules import IoState, interpret
from cdpr_drivers.modbus.tcp import ModbusTcp
from cdpr_profiles.devices.safety_io import SafetyIoProfile
from cdpr_rt.core.clock import Clock


class IoLink:
    """A connection to one safety I/O; every method raises ModbusError."""

    def __init__(self, profile: SafetyIoProfile, clock: Clock) -> None:
        self.profile = profile
        self.clock = clock
        place = (profile.host, profile.port, profile.unit)
        self._client = ModbusTcp(*place, profile.answer_timeout_s, clock)
        self.name = f"safety I/O {self._client.name}"
        self._inputs = _span(point.input for _, point in profile.inputs())
        self._coils = _span(point.coil for _, point in profile.outputs())
        self._count = 0

    def read(self) -> tuple[dict[int, bool], dict[int, bool]]:
        """Return the discrete inputs and the coils by address."""
        start, count = self._inputs
        inputs = dict(enumerate(self._client.inputs(start, count), start))
        start, count = self._coils
        return inputs, dict(enumerate(self._client.coils(start, count), start))

    def state(self) -> IoState:
        """Return what the I/O says now."""
        began_s = self.clock.now_s
        return interpret(self.profile, *self.read(), began_s)

    def write(self, coil: int, on: bool) -> None:
        """Set one coil."""
        self._client.write_coil(coil, on)

    def set_watchdog(self) -> None:
        """Tell the device after what time without us its outputs have to drop."""
        watchdog = self.profile.watchdog
        if watchdog is not None and watchdog.timeout_register is not None:
            time_units = round(watchdog.timeout_s / watchdog.timeout_unit_s)
            self._client.write_registers(watchdog.timeout_register, [time_units])

    def feed_watchdog(self) -> None:
        """Tell the device that we are there."""
        watchdog = self.profile.watchdog
        if watchdog is not None and watchdog.trigger_register is not None:
            self._count = (self._count + 1) & 0xFFFF
            self._client.write_registers(watchdog.trigger_register, [self._count])

    def close(self) -> None:
        """Leave the device."""
        self._client.close()


def _span(addresses: Iterable[int]) -> tuple[int, int]:
    """Return start and count of the shortest span over all addresses."""
    known = sorted(addresses)
    return known[0], known[-1] - known[0] + 1
