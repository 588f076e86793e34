"""Real Modbus servers for simulated devices: TCP, and RTU on a pseudo-terminal.

The TCP server has a panel for buttons and faults; the RTU server replaces a serial adapter.
"""

from __future__ import annotations

import asyncio
import contextlib
import gc
import json
import logging
import os
import signal
import sys
import tty
from collections.abc import Callable, Sequence
from typing import Any

from pymodbus.constants import ExcCodes
from pymodbus.framer.rtu import FramerRTU
from pymodbus.server import ModbusSerialServer, ModbusTcpServer
from pymodbus.simulator import DataType, SimData, SimDevice

from cdpr_sim_bus.devices.sim_inclinometer import SimInclinometer
from cdpr_sim_bus.devices.sim_load_cells import SimAmplifier
from cdpr_sim_bus.errors import BusSetupError
from cdpr_sim_bus.physics_board import TensionFault

_STEP_S = 0.002
_UNIT_AT = 6
_PANEL_UNITS = (247, 246)
END_OF_ANSWER = bytes.fromhex("0000 ffff 0002 0000")
"""Sent by devices in lockstep if an answer is missing or cut off: no more bytes follow."""


class AnswerFaults:
    """Faults of one unit's answers on the wire."""

    def __init__(self, unit: int, *, lockstep: bool) -> None:
        self._unit = unit
        self._end = END_OF_ANSWER if lockstep else b""
        self.silent = False
        self.truncated = False
        self.wrong_unit = False

    def corrupt(self, sending: bool, data: bytes) -> bytes:
        """Return the bytes to send instead of an answer."""
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
        """Provide `registers`: functions called with the value written to addresses from 0 on."""
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
    """Serve `units` on 127.0.0.1:port (0: any free port) until SIGTERM or SIGINT.

    `step`, if given, is called every 2 ms. When everything is ready, one line of JSON goes to
    standard output: {"ready": {"host", "port", "pid", and `details`}}. Raises BusSetupError if the
    port is in use.
    """
    ended = _end_event(until_stdin_ends)
    if not any(unit.id == 0 for unit in units):
        units = [*units, _other_units()]
    server = ModbusTcpServer(units, address=("127.0.0.1", port), trace_packet=line.corrupt)
    try:
        await server.serve_forever(background=True)
    except RuntimeError:
        raise BusSetupError(f"port {port} of 127.0.0.1 cannot be opened; choose another") from None
    listening: Any = server.transport
    where = {"host": "127.0.0.1", "port": listening.sockets[0].getsockname()[1]}
    _say_ready({**where, "pid": os.getpid(), **details})
    while step is not None and not ended.is_set():
        step()
        with contextlib.suppress(TimeoutError):
            await asyncio.wait_for(ended.wait(), _STEP_S)
    await ended.wait()
    shutdown: Any = server.shutdown
    await shutdown()


def _say_ready(ready: dict[str, Any]) -> None:
    gc.collect()
    gc.freeze()  # otherwise the collector scans all registers for 0.1 s while a client waits
    print(json.dumps({"ready": ready}), flush=True)


def _end_event(
    until_stdin_ends: bool, obey: Callable[[list[str]], None] | None = None
) -> asyncio.Event:
    """Return an event set by SIGTERM, SIGINT and, if wanted, the end of standard input.

    The words of each line on standard input are passed to `obey`.
    """
    loop, ended, rest = asyncio.get_running_loop(), asyncio.Event(), b""
    for number in (signal.SIGINT, signal.SIGTERM):
        loop.add_signal_handler(number, ended.set)
    if not until_stdin_ends and obey is None:
        return ended
    descriptor = sys.stdin.fileno()

    def read() -> None:
        nonlocal rest
        data = os.read(descriptor, _CHUNK)
        if not data:
            loop.remove_reader(descriptor)
            if until_stdin_ends:
                ended.set()
            return
        *lines, rest = (rest + data).split(b"\n")
        for line in lines:
            if obey is not None:
                obey(line.decode(errors="replace").split())

    try:
        loop.add_reader(descriptor, read)
    except PermissionError:
        if until_stdin_ends:
            raise BusSetupError("--exit-with-stdin: standard input must be a pipe") from None
    return ended


_CHUNK = 4096
_CRC_BYTES = 2
# time that a device needs to answer, besides the time on the wire
_TURNAROUND_S = 0.001

# a device does not report invalid requests of its masters
logging.getLogger("pymodbus").setLevel(logging.CRITICAL)


class RtuServer:
    """Serves `units` on a pseudo-terminal until SIGTERM, SIGINT or `unplug`.

    Lines on standard input, if it is a pipe or a terminal, create and mend faults:
    `over-range 3`, `broken-wire all`, `silent 2`, `truncated 1`, `wrong-crc 1`, `wrong-unit 1`,
    `mend all`, `unplug`. The server answers each with a line of JSON on standard output.
    """

    def __init__(
        self,
        units: Sequence[SimAmplifier | SimInclinometer],
        baudrate: int,
        bits_per_byte: int,
        *,
        lockstep: bool,
    ) -> None:
        self._units = {unit.unit: unit for unit in units}
        self._byte_s = bits_per_byte / baudrate
        self._lockstep = lockstep
        self._descriptors: list[int] = []
        self._outside = self._inside = -1
        self._asked = 0

    async def serve(self, details: dict[str, Any], until_stdin_ends: bool) -> None:
        """Serve; when ready, print one line {"ready": {"port", "pid", and `details`}}."""
        loop = asyncio.get_running_loop()
        self._ended = _end_event(until_stdin_ends, lambda words: self._obey(loop, words))
        path, server_end = self._open_terminals()
        devices = [unit.device() for unit in self._units.values()]
        server = ModbusSerialServer(
            devices, port=server_end, ignore_missing_devices=True, trace_packet=self._corrupt
        )
        try:
            await server.serve_forever(background=True)
            loop.add_reader(self._outside, self._to_server)
            loop.add_reader(self._inside, self._to_master, loop)
            ready = {"port": path, "pid": os.getpid(), "units": list(self._units), **details}
            _say_ready(ready)
            await self._ended.wait()
        finally:
            shutdown: Any = server.shutdown
            await shutdown()
            for descriptor in self._descriptors:
                with contextlib.suppress(OSError):
                    os.close(descriptor)

    # -- the line

    def _open_terminals(self) -> tuple[str, str]:
        """Open two pseudo-terminals; return the paths of the master's and of the server's end."""
        paths = []
        for side in ("_outside", "_inside"):
            controller, terminal = os.openpty()
            tty.setraw(terminal)
            os.set_blocking(controller, False)
            setattr(self, side, controller)
            # one end stays open here: it keeps the terminal alive while no client has it open
            self._descriptors += [controller, terminal]
            paths.append(os.ttyname(terminal))
        return paths[0], paths[1]

    def _to_server(self) -> None:
        data = self._read(self._outside)
        self._asked = len(data)
        if data:
            os.write(self._inside, data)

    def _to_master(self, loop: asyncio.AbstractEventLoop) -> None:
        data = self._read(self._inside)
        if self._lockstep:  # the client lets bus time pass for the time on the wire
            self._deliver(data)
        elif data:  # request and answer take their real time on the wire
            wire_s = (self._asked + len(data)) * self._byte_s
            self._asked = 0
            loop.call_later(wire_s + _TURNAROUND_S, self._deliver, data)

    def _deliver(self, data: bytes) -> None:
        with contextlib.suppress(OSError):  # the terminal was closed meanwhile, or nobody reads
            os.write(self._outside, data)

    @staticmethod
    def _read(descriptor: int) -> bytes:
        try:
            return os.read(descriptor, _CHUNK)
        except OSError:
            return b""

    def _corrupt(self, sending: bool, data: bytes) -> bytes:
        """Return the bytes to send instead of an answer."""
        unit = self._units.get(data[0]) if data else None
        if not sending:
            return data
        end = END_OF_ANSWER if self._lockstep else b""
        # the library also answers for missing units; on a real line nobody does
        if unit is None or unit.fault is TensionFault.SILENT:
            return end
        if unit.fault is TensionFault.TRUNCATED:
            return data[: len(data) - 3] + end
        if unit.fault is TensionFault.WRONG_CRC:
            return data[:-1] + bytes([data[-1] ^ 0xFF])
        if unit.fault is TensionFault.WRONG_UNIT:
            changed = bytes([data[0] % 247 + 1]) + data[1:-_CRC_BYTES]
            return changed + FramerRTU.compute_CRC(changed).to_bytes(_CRC_BYTES, "big")
        return data

    # -- fault injection

    def _obey(self, loop: asyncio.AbstractEventLoop, words: list[str]) -> None:
        if words == ["unplug"]:
            for side in (self._outside, self._inside):
                loop.remove_reader(side)
            self._ended.set()
            answer: dict[str, Any] = {"unplugged": True}
        else:
            try:
                self.set_fault(words)
                answer = {"done": " ".join(words)}
            except BusSetupError as error:
                answer = {"error": str(error)}
        print(json.dumps(answer), flush=True)

    def set_fault(self, words: list[str]) -> None:
        """Set the fault given by [fault, unit or "all"]; raises BusSetupError if it is unknown."""
        known = {fault.value: fault for fault in TensionFault}
        whose = words[1] if len(words) > 1 else "all"
        units = [u for u in self._units.values() if whose in ("all", str(u.unit))]
        if not words or words[0] not in known or not units:
            raise BusSetupError(
                f"{' '.join(words)!r}; allowed: {', '.join(known)} with a unit "
                f"({', '.join(map(str, self._units))}) or all, or unplug"
            )
        for unit in units:
            unit.fault = known[words[0]]


async def serve_rtu(
    units: Sequence[SimAmplifier | SimInclinometer],
    baudrate: int,
    *,
    bits_per_byte: int,
    lockstep: bool,
    faults: Sequence[list[str]],
    details: dict[str, Any],
    until_stdin_ends: bool,
) -> None:
    """Serve `units` as RtuServer does, with `faults` from the start.

    Answers take their real time on the wire unless the units are in `lockstep`.
    """
    server = RtuServer(units, baudrate, bits_per_byte, lockstep=lockstep)
    for words in faults:
        server.set_fault(words)
    await server.serve(details, until_stdin_ends)
