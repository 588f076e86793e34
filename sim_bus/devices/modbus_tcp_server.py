"""A real Modbus TCP server for simulated devices, with a panel for buttons and faults."""

from __future__ import annotations

import asyncio
import contextlib
import json
import logging
import os
import signal
import sys
from collections.abc import Callable
from typing import Any

from pymodbus.constants import ExcCodes
from pymodbus.server import ModbusTcpServer
from pymodbus.simulator import DataType, SimData, SimDevice

from cdpr_sim_bus.errors import BusSetupError

_STEP_S = 0.002
_UNIT_AT = 6
_PANEL_UNITS = (247, 246)
END_OF_ANSWER = bytes.fromhex("0000 ffff 0002 0000")
"""Sent by devices in lockstep where an answer is missing or cut off: nothing more will come."""

# a device says nothing about what its masters ask wrongly
logging.getLogger("pymodbus").setLevel(logging.CRITICAL)


class AnswerFaults:
    """Faults of one unit's answers on the wire."""

    def __init__(self, unit: int, *, lockstep: bool) -> None:
        self._unit = unit
        self._end = END_OF_ANSWER if lockstep else b""
        self.silent = False
        self.truncated = False
        self.wrong_unit = False

    def corrupt(self, sending: bool, data: bytes) -> bytes:
        """Return the bytes that go out in place of an answer."""
        ours = len(data) > _UNIT_AT and (data[_UNIT_AT] == self._unit or not self._unit)
        if not sending or not ours or data[_UNIT_AT] in _PANEL_UNITS:
            return data
        if self.silent:
            return self._end
        if self.wrong_unit:
            data = data[:_UNIT_AT] + bytes([(data[_UNIT_AT] + 1) & 0xFF]) + data[_UNIT_AT + 1 :]
        return data[: len(data) - 1] + self._end if self.truncated else data


class Panel:
    """Holding registers of a separate unit, to press buttons and inject faults."""

    def __init__(self, unit: int, registers: dict[int, Callable[[int], None]]) -> None:
        """Offer `registers`: what is called with the value written to each address from 0 on."""
        self.unit = _PANEL_UNITS[0] if unit != _PANEL_UNITS[0] else _PANEL_UNITS[1]
        self._registers = registers

    def device(self) -> SimDevice:
        """Return the unit to serve."""
        data = SimData(0, values=[0] * len(self._registers), datatype=DataType.REGISTERS)
        return SimDevice(self.unit, data, action=self._act)

    async def _act(
        self,
        _code: int,
        _start: int,
        address: int,
        _count: int,
        _registers: list[int],
        values: list[int] | list[bool] | None,
    ) -> None:
        for offset, value in enumerate(values or ()):
            self._registers[address + offset](int(value))


def _other_units() -> SimDevice:
    """Return the device that answers for every other unit, as a gateway does."""

    async def refuse(*_: object) -> ExcCodes:
        return ExcCodes.GATEWAY_NO_RESPONSE

    everything = SimData(0, values=[0] * 0x10000, datatype=DataType.REGISTERS)
    return SimDevice(0, everything, action=refuse)


async def serve_units(
    units: list[SimDevice],
    line: AnswerFaults,
    step: Callable[[], None] | None,
    port: int,
    details: dict[str, Any],
    until_stdin_ends: bool,
) -> None:
    """Serve `units` on 127.0.0.1:port (0: any that is free) until SIGTERM or SIGINT.

    `step` is called every 2 ms, where there is one. When all is up, one line of JSON goes to
    standard output: {"ready": {"host", "port", "pid", and `details`}}. Raises BusSetupError for a
    port in use.
    """
    loop = asyncio.get_running_loop()
    ended = asyncio.Event()
    for number in (signal.SIGINT, signal.SIGTERM):
        loop.add_signal_handler(number, ended.set)
    if until_stdin_ends:
        _end_with_stdin(loop, ended)
    if not any(unit.id == 0 for unit in units):
        units = [*units, _other_units()]
    server = ModbusTcpServer(units, address=("127.0.0.1", port), trace_packet=line.corrupt)
    try:
        await server.serve_forever(background=True)
    except RuntimeError:
        raise BusSetupError(f"port {port} of 127.0.0.1 cannot be opened; choose another") from None
    listening: Any = server.transport
    where = {"host": "127.0.0.1", "port": listening.sockets[0].getsockname()[1]}
    print(json.dumps({"ready": {**where, "pid": os.getpid(), **details}}), flush=True)
    while step is not None and not ended.is_set():
        step()
        with contextlib.suppress(TimeoutError):
            await asyncio.wait_for(ended.wait(), _STEP_S)
    await ended.wait()
    shutdown: Any = server.shutdown
    await shutdown()


def _end_with_stdin(loop: asyncio.AbstractEventLoop, ended: asyncio.Event) -> None:
    descriptor = sys.stdin.fileno()

    def read() -> None:
        if not os.read(descriptor, 4096):
            ended.set()

    try:
        loop.add_reader(descriptor, read)
    except PermissionError:
        raise BusSetupError("standard input must be a pipe to be watched for its end") from None
