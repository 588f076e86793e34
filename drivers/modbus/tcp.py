"""Modbus TCP client of one device."""

from __future__ import annotations

import logging
import socket
import struct
from typing import Final

from pymodbus.exceptions import ModbusException
from pymodbus.framer import FramerBase
from pymodbus.framer.socket import FramerSocket
from pymodbus.pdu import (
    DecodePDU,
    ExceptionResponse,
    ModbusPDU,
    ReadCoilsRequest,
    ReadHoldingRegistersRequest,
)
from pymodbus.pdu.bit_message import ReadDiscreteInputsRequest, WriteSingleCoilRequest
from pymodbus.pdu.register_message import WriteMultipleRegistersRequest

from cdpr_drivers.errors import DriverError
from cdpr_drivers.modbus.byte_channel import ByteChannel
from cdpr_rt.core.clock import Clock

_CONNECT_TIMEOUT_S = 1.0
_HEADER_BYTES, _LENGTH_AT, _UNIT_AT = 8, 4, 6
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


def refusal(answer: ExceptionResponse) -> str:
    """Return in words that, and why, a device refuses."""
    code = answer.exception_code
    return f"refused with exception {code} ({_EXCEPTIONS.get(code, 'unknown exception')})"


def answer_in(data: bytes, framer: FramerBase, unit: int, number: int = 0) -> ModbusPDU | None:
    """Return the answer that `data` hold to the request with this number; None for no such."""
    try:
        return framer.handleFrame(data, unit, number)[1]
    except (ModbusException, ValueError, IndexError, struct.error):
        return None


class ModbusTcp:
    """Requests to one unit behind host:port; connects by itself, anew after every error.

    For one task of `clock` at a time. Every method raises ModbusError, which names device, request
    and reason.
    """

    def __init__(self, host: str, port: int, unit: int, timeout_s: float, clock: Clock) -> None:
        self.name = f"{host}:{port}"
        self._host, self._port, self._unit = host, port, unit
        self._timeout_s = timeout_s
        self._clock = clock
        self._framer = FramerSocket(DecodePDU(False))
        self._socket: socket.socket | None = None
        self._channel: ByteChannel | None = None
        self._count = 0

    def close(self) -> None:
        """Leave the device; a later request connects again."""
        if self._channel is not None:
            self._channel.close()
            self._channel = None
        if self._socket is not None:
            self._socket.close()
            self._socket = None

    def inputs(self, start: int, count: int) -> list[bool]:
        """Return `count` discrete inputs from address `start` on."""
        return self._bits("discrete input", ReadDiscreteInputsRequest, start, count)

    def coils(self, start: int, count: int) -> list[bool]:
        """Return what `count` coils from address `start` on hold."""
        return self._bits("coil", ReadCoilsRequest, start, count)

    def registers(self, start: int, count: int) -> list[int]:
        """Return `count` holding registers from address `start` on."""
        what = _named("holding register", start, count)
        answer = self._ask(what, ReadHoldingRegistersRequest(address=start, count=count))
        if len(answer.registers) != count:
            raise self._wrong(what, f"{len(answer.registers)} registers came, not {count}")
        return list(answer.registers)

    def write_coil(self, address: int, on: bool) -> None:
        """Set one coil."""
        what = f"set coil {address} to {int(on)}"
        answer = self._ask(what, WriteSingleCoilRequest(address=address, bits=[on]))
        if answer.address != address or answer.bits[0] != on:
            raise self._wrong(what, "the answer is that to another request")

    def write_registers(self, start: int, values: list[int]) -> None:
        """Set holding registers from address `start` on, in one request."""
        what = f"set {_named('holding register', start, len(values))} to {values}"
        answer = self._ask(what, WriteMultipleRegistersRequest(address=start, registers=values))
        if answer.address != start or answer.count != len(values):
            raise self._wrong(what, "the answer is that to another request")

    def _bits(self, kind: str, request: type[ModbusPDU], start: int, count: int) -> list[bool]:
        what = _named(kind, start, count)
        answer = self._ask(what, request(address=start, count=count))
        if not count <= len(answer.bits) < count + 8:
            raise self._wrong(what, f"{len(answer.bits)} bits came, not {count}")
        return list(answer.bits[:count])

    def _ask(self, what: str, request: ModbusPDU) -> ModbusPDU:
        channel = self._connect()
        self._count = self._count % 0xFFFF + 1
        request.dev_id, request.transaction_id = self._unit, self._count
        data = channel.ask(self._framer.buildFrame(request), _is_whole, self._timeout_s)
        answer = answer_in(data, self._framer, self._unit, self._count)
        if answer is None:
            raise self._wrong(what, self._missing_answer_reason(data, channel.lost))
        if isinstance(answer, ExceptionResponse):
            raise ModbusError(f"{self.name}: {what}: {refusal(answer)}")
        if answer.function_code != request.function_code:
            code, asked = answer.function_code, request.function_code
            raise self._wrong(what, f"function {code} was answered, {asked} was asked")
        return answer

    def _connect(self) -> ByteChannel:
        if self._channel is not None and not self._channel.lost:
            return self._channel
        self.close()
        there = (self._host, self._port)
        timeout_s = max(self._timeout_s, _CONNECT_TIMEOUT_S)
        try:
            sock = self._clock.run_blocking(lambda: socket.create_connection(there, timeout_s))
            # small requests go out at once
            sock.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        except OSError as error:
            reason = error.strerror or str(error)
            raise ModbusError(
                f"{self.name}: cannot connect: {reason}; check host, port and cable"
            ) from None
        self._socket, self._channel = sock, ByteChannel(self._clock, sock.fileno())
        return self._channel

    def _missing_answer_reason(self, data: bytes, lost: bool) -> str:
        if not data:
            silent = f"no answer within {self._timeout_s:g} s from unit {self._unit}"
            return "the device has closed the connection" if lost else silent
        if len(data) > _UNIT_AT and self._unit and data[_UNIT_AT] != self._unit:
            return f"unit {data[_UNIT_AT]} answered, unit {self._unit} was asked"
        if len(data) < _HEADER_BYTES or not _is_whole(data):
            return f"the answer was cut off after {len(data)} bytes"
        return f"the answer makes no sense ({data[:16].hex(' ')})"

    def _wrong(self, what: str, reason: str) -> ModbusError:
        """Return the error, after closing a connection whose state is not known any more."""
        self.close()
        return ModbusError(f"{self.name}: {what}: {reason}")


def _is_whole(data: bytes) -> bool:
    return len(data) >= _LENGTH_AT + 2 + int.from_bytes(data[_LENGTH_AT : _LENGTH_AT + 2], "big")


def _named(kind: str, start: int, count: int) -> str:
    return f"{kind} {start}" if count == 1 else f"{kind}s {start} to {start + count - 1}"
