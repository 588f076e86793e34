"""One device on Modbus TCP: requests that succeed or say in words why not."""

from __future__ import annotations

import logging
import socket
import struct
from collections.abc import Callable
from typing import Any, Final

from pymodbus.client import ModbusTcpClient
from pymodbus.exceptions import ModbusException

from drivers.errors import DriverError

_CONNECT_TIMEOUT_S = 1.0
_HEADER_BYTES, _UNIT_AT = 8, 6
_READ_COILS, _READ_INPUTS, _READ_REGISTERS, _WRITE_COIL, _WRITE_REGISTERS = 1, 2, 3, 5, 16
_EXCEPTIONS: Final = {
    1: "illegal function: the device does not know this kind of request",
    2: "illegal data address: the device has no such input, coil or register",
    3: "illegal data value",
    4: "device failure",
    5: "acknowledge: the device needs more time",
    6: "device busy",
    8: "memory parity error",
    10: "gateway path unavailable",
    11: "gateway target does not respond: is the unit id right?",
}

# what the library logs is raised here as errors of our own
logging.getLogger("pymodbus").setLevel(logging.CRITICAL)


class ModbusError(DriverError):
    """A Modbus device cannot be reached, or did not do what was asked."""


def exception_text(code: int) -> str:
    """Return what an exception code of Modbus means."""
    return _EXCEPTIONS.get(code, "unknown exception")


class ModbusTcp:
    """Requests to one unit behind host:port; connects by itself, anew after every error.

    Not for several threads at once. Every method raises ModbusError, which names device, request
    and reason.
    """

    def __init__(self, host: str, port: int, unit: int, timeout_s: float) -> None:
        self.name = f"{host}:{port}"
        self._host, self._port, self._unit = host, port, unit
        self._timeout_s = timeout_s
        self._received = b""
        self._client = ModbusTcpClient(
            host, port=port, timeout=timeout_s, retries=0, trace_packet=self._trace
        )

    def close(self) -> None:
        """Leave the device; a later request connects again."""
        if self._client.socket is not None:
            self._client.socket.close()
            self._client.socket = None

    def inputs(self, start: int, count: int) -> list[bool]:
        """Return `count` discrete inputs from address `start` on."""
        read: Callable[..., Any] = self._client.read_discrete_inputs
        return self._bits("discrete input", _READ_INPUTS, read, start, count)

    def coils(self, start: int, count: int) -> list[bool]:
        """Return what `count` coils from address `start` on hold."""
        return self._bits("coil", _READ_COILS, self._client.read_coils, start, count)

    def registers(self, start: int, count: int) -> list[int]:
        """Return `count` holding registers from address `start` on."""
        what = _named("holding register", start, count)
        read = self._client.read_holding_registers
        answer = self._ask(what, _READ_REGISTERS, read, start, count=count)
        if len(answer.registers) != count:
            raise self._wrong(what, f"{len(answer.registers)} registers came, not {count}")
        return [int(value) for value in answer.registers]

    def write_coil(self, address: int, on: bool) -> None:
        """Set one coil."""
        what = f"set coil {address} to {int(on)}"
        answer = self._ask(what, _WRITE_COIL, self._client.write_coil, address, on)
        if answer.address != address or bool(answer.bits[0]) != on:
            raise self._wrong(what, "the answer is that to another request")

    def write_registers(self, start: int, values: list[int]) -> None:
        """Set holding registers from address `start` on, in one request."""
        what = f"set {_named('holding register', start, len(values))} to {values}"
        answer = self._ask(what, _WRITE_REGISTERS, self._client.write_registers, start, values)
        if answer.address != start or answer.count != len(values):
            raise self._wrong(what, "the answer is that to another request")

    def _bits(
        self, kind: str, code: int, read: Callable[..., Any], start: int, count: int
    ) -> list[bool]:
        what = _named(kind, start, count)
        answer = self._ask(what, code, read, start, count=count)
        if not count <= len(answer.bits) < count + 8:
            raise self._wrong(what, f"{len(answer.bits)} bits came, not {count}")
        return [bool(bit) for bit in answer.bits[:count]]

    def _ask(
        self, what: str, code: int, request: Callable[..., Any], *args: Any, **named: Any
    ) -> Any:
        self._connect()
        self._received = b""
        try:
            answer = request(*args, **named, device_id=self._unit)
        except ModbusException:
            raise self._wrong(what, self._why_no_answer()) from None
        except (OSError, ValueError, IndexError, struct.error) as error:
            raise self._wrong(what, f"the answer makes no sense ({error})") from None
        if answer.isError():
            number = getattr(answer, "exception_code", 0)
            reason = exception_text(number)
            raise ModbusError(f"{self.name}: {what}: refused with exception {number} ({reason})")
        if answer.function_code != code:
            problem = f"function {answer.function_code} was answered, {code} was asked"
            raise self._wrong(what, problem)
        return answer

    def _connect(self) -> None:
        """Connect here rather than in the library, which would keep the reason to itself."""
        if self._client.socket is not None:
            return
        try:
            self._client.socket = socket.create_connection(
                (self._host, self._port), max(self._timeout_s, _CONNECT_TIMEOUT_S)
            )
            # small requests go out at once
            self._client.socket.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        except OSError as error:
            reason = error.strerror or str(error)
            raise ModbusError(
                f"{self.name}: cannot connect: {reason}; check host, port and cable"
            ) from None

    def _trace(self, sending: bool, data: bytes) -> bytes:
        if not sending:
            self._received = data
        return data

    def _why_no_answer(self) -> str:
        data = self._received
        if not data:
            closed = self._client.socket is None
            lost = "the device has closed the connection"
            silent = f"no answer within {self._timeout_s:g} s from unit {self._unit}"
            return lost if closed else silent
        if len(data) > _UNIT_AT and self._unit and data[_UNIT_AT] != self._unit:
            return f"unit {data[_UNIT_AT]} answered, unit {self._unit} was asked"
        if len(data) < _HEADER_BYTES or len(data) < 6 + int.from_bytes(data[4:6], "big"):
            return f"the answer was cut off after {len(data)} bytes"
        return f"the answer makes no sense ({data[:16].hex(' ')})"

    def _wrong(self, what: str, reason: str) -> ModbusError:
        """Return the error, after leaving a connection on which nothing can be believed now."""
        self.close()
        return ModbusError(f"{self.name}: {what}: {reason}")


def _named(kind: str, start: int, count: int) -> str:
    return f"{kind} {start}" if count == 1 else f"{kind}s {start} to {start + count - 1}"
