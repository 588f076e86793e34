"""Modbus to one device: a byte channel that waits by the robot's clock, and TCP and RTU on it."""

from __future__ import annotations

import logging
import math
import os
import select
import socket
import struct
import termios
from collections.abc import Callable
from pathlib import Path
from typing import Any, Final, Literal

import serial  # type: ignore[import-untyped]
from pymodbus.exceptions import ModbusException
from pymodbus.framer import FramerBase
from pymodbus.framer.rtu import FramerRTU
from pymodbus.framer.socket import FramerSocket
from pymodbus.pdu import (
    DecodePDU,
    ExceptionResponse,
    ModbusPDU,
    ReadCoilsRequest,
    ReadHoldingRegistersRequest,
)
from pymodbus.pdu.bit_message import ReadDiscreteInputsRequest, WriteSingleCoilRequest
from pymodbus.pdu.register_message import (
    ReadInputRegistersRequest,
    WriteMultipleRegistersRequest,
    WriteSingleRegisterRequest,
)

from cdpr_drivers.errors import DriverError
from cdpr_rt.core.clock import Clock

_CHUNK: Final = 4096
_END_OF_ANSWER: Final = bytes.fromhex("0000 ffff 0002 0000")
_DEAD_PEER_S: Final = 30.0


class ByteChannel:
    """Requests and answers through a descriptor; a source of the clock.

    In lockstep, bus time stands still until the answer has arrived, even if the device's process
    is late. That process marks an answer that is missing or cut off (docs/reference/wire.md).
    """

    def __init__(self, clock: Clock, descriptor: int) -> None:
        os.set_blocking(descriptor, False)
        self._clock = clock
        self._descriptor = descriptor
        self._received = b""
        self.lost = False
        """Whether the other end is gone."""
        clock.add(self)

    def ask(self, question: bytes, is_whole: Callable[[bytes], bool], timeout_s: float) -> bytes:
        """Send `question` and return the bytes received until they are complete or time is up."""
        self.poll()
        self._received = b""  # late bytes of the previous answer are discarded
        try:
            if os.write(self._descriptor, question) < len(question):
                self._lose()
        except OSError:
            self._lose()

        def ended() -> bool:
            data = self._received
            return self.lost or is_whole(data) or data.endswith(_END_OF_ANSWER)

        clock = self._clock
        asked_s = clock.now_s
        if clock.lockstep:
            self._await_in_lockstep(ended)
        else:
            clock.wait(ended, asked_s + timeout_s)
        answer = self._received.removesuffix(_END_OF_ANSWER)
        if not self.lost and not is_whole(answer):
            clock.wait(None, asked_s + timeout_s)
        return answer

    def _await_in_lockstep(self, ended: Callable[[], bool]) -> None:
        """Read while bus time stands still; a device that does not answer at all counts as dead."""
        waiting = select.poll()
        waiting.register(self._descriptor, select.POLLIN)
        while not ended() and waiting.poll(1e3 * _DEAD_PEER_S):
            self.poll()

    def close(self) -> None:
        """Remove the channel from the clock; the owner closes the descriptor."""
        self._clock.remove(self)

    def _lose(self) -> None:
        self.lost = True
        self.close()

    # -- as a source of the clock

    def fileno(self) -> int:
        """Return the descriptor."""
        return self._descriptor

    def poll(self) -> bool:
        """Read the bytes that have arrived."""
        if self.lost:
            return False
        try:
            data = os.read(self._descriptor, _CHUNK)
        except BlockingIOError:
            return False
        except OSError:
            data = b""
        if data:
            self._received += data
        else:
            self._lose()
        return True

    def tick(self, now_s: float) -> float:  # noqa: ARG002  # no event is ever scheduled
        """Return infinity: no event is ever scheduled."""
        return math.inf


# Modbus TCP client of one device.

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

# this module raises its own errors for everything that the library logs
logging.getLogger("pymodbus").setLevel(logging.CRITICAL)


class ModbusError(DriverError):
    """A Modbus device cannot be reached, or did not carry out a request."""


def refusal(answer: ExceptionResponse) -> str:
    """Return as text that a device refuses, and why."""
    code = answer.exception_code
    return f"refused with exception {code} ({_EXCEPTIONS.get(code, 'unknown exception')})"


def answer_in(data: bytes, framer: FramerBase, unit: int, number: int = 0) -> ModbusPDU | None:
    """Return the answer in `data` to the request with this number, or None."""
    try:
        return framer.handleFrame(data, unit, number)[1]
    except (ModbusException, ValueError, IndexError, struct.error):
        return None


class ModbusTcp:
    """Requests to one unit behind host:port; connects automatically, and again after every error.

    Only one task of `clock` may use it at a time. Every method raises ModbusError, which names
    device, request and reason.
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
        """Disconnect from the device; a later request connects again."""
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
        """Return the values of `count` coils from address `start` on."""
        return self._bits("coil", ReadCoilsRequest, start, count)

    def registers(self, start: int, count: int) -> list[int]:
        """Return `count` holding registers from address `start` on."""
        what = _named("holding register", start, count)
        answer = self._ask(what, ReadHoldingRegistersRequest(address=start, count=count))
        if len(answer.registers) != count:
            raise self._wrong(what, f"{len(answer.registers)} registers arrived; expected: {count}")
        return list(answer.registers)

    def write_coil(self, address: int, on: bool) -> None:
        """Set one coil."""
        what = f"set coil {address} to {int(on)}"
        answer = self._ask(what, WriteSingleCoilRequest(address=address, bits=[on]))
        if answer.address != address or answer.bits[0] != on:
            raise self._wrong(what, "the answer belongs to another request")

    def write_registers(self, start: int, values: list[int]) -> None:
        """Set holding registers from address `start` on, in one request."""
        what = f"set {_named('holding register', start, len(values))} to {values}"
        answer = self._ask(what, WriteMultipleRegistersRequest(address=start, registers=values))
        if answer.address != start or answer.count != len(values):
            raise self._wrong(what, "the answer belongs to another request")

    def _bits(self, kind: str, request: type[ModbusPDU], start: int, count: int) -> list[bool]:
        what = _named(kind, start, count)
        answer = self._ask(what, request(address=start, count=count))
        if not count <= len(answer.bits) < count + 8:
            raise self._wrong(what, f"{len(answer.bits)} bits arrived, not {count}")
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
            raise self._wrong(what, f"function {code} was answered, but {asked} was requested")
        return answer

    def _connect(self) -> ByteChannel:
        if self._channel is not None and not self._channel.lost:
            return self._channel
        self.close()
        there = (self._host, self._port)
        timeout_s = max(self._timeout_s, _CONNECT_TIMEOUT_S)
        try:
            sock = self._clock.run_blocking(lambda: socket.create_connection(there, timeout_s))
            # send small requests immediately
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
            return f"unit {data[_UNIT_AT]} answered, but unit {self._unit} was asked"
        if len(data) < _HEADER_BYTES or not _is_whole(data):
            return f"the answer was cut off after {len(data)} bytes"
        return f"the answer is invalid ({data[:16].hex(' ')})"

    def _wrong(self, what: str, reason: str) -> ModbusError:
        """Close the connection, whose state is unknown, and return the error."""
        self.close()
        return ModbusError(f"{self.name}: {what}: {reason}")


def _is_whole(data: bytes) -> bool:
    return len(data) >= _LENGTH_AT + 2 + int.from_bytes(data[_LENGTH_AT : _LENGTH_AT + 2], "big")


def _named(kind: str, start: int, count: int) -> str:
    return f"{kind} {start}" if count == 1 else f"{kind}s {start} to {start + count - 1}"


# Modbus RTU master on one RS-485 line.

_READS: Final[dict[str, type[ModbusPDU]]] = {
    "holding": ReadHoldingRegistersRequest,
    "input": ReadInputRegistersRequest,
}
_READ_CODES: Final = (3, 4)
_EXCEPTION_BYTES, _ECHO_BYTES = 5, 8
_TURNAROUND_S: Final = 0.001
"""Time that a device needs to answer, in addition to the time on the wire."""


class LineError(ModbusError):
    """The serial port itself cannot be opened or is gone."""


class ModbusLine:
    """Requests over one serial port; opens it automatically, and again after it was lost.

    Only one task of `clock` may use it at a time. Every method raises ModbusError, which names
    port, unit, request and reason (LineError if the port is the cause). In lockstep an answer is
    sampled at the time of the request, and returned when it would have arrived: `clock` counts its
    time on the wire.
    """

    def __init__(
        self,
        port: str,
        baudrate: int,
        clock: Clock,
        *,
        parity: str = "N",
        stop_bits: int = 1,
        timeout_s: float = 0.1,
        retries: int = 1,
    ) -> None:
        self.name = port
        self._settings: dict[str, Any] = {
            "baudrate": baudrate,
            # a pseudo-terminal has no parity and may fail if one is set
            "parity": "N" if Path(port).resolve().is_relative_to("/dev/pts") else parity,
            "stopbits": stop_bits,
            "exclusive": True,
            # VMIN 1: with it, an empty read means that the port is lost
            "inter_byte_timeout": 0,
        }
        self._clock = clock
        self._byte_s = (9 + stop_bits + (parity != "N")) / baudrate
        self._timeout_s = timeout_s
        self._retries = retries
        self.repeated = 0
        """Requests that had to be repeated so far."""
        self.retrying = True
        """Whether a failed request is repeated."""
        self._framer = FramerRTU(DecodePDU(False))
        self._port: Any = None
        self._channel: ByteChannel | None = None

    def open(self) -> ByteChannel:
        """Open the port if it is closed; the first request does so too. Raises LineError."""
        if self._channel is not None:
            return self._channel
        try:
            self._port = serial.Serial(self.name, **self._settings)
        except (OSError, ValueError, termios.error) as error:  # SerialException is an OSError
            number = getattr(error, "errno", None) or error.args[0]
            reason = os.strerror(number) if isinstance(number, int) else str(error)
            raise LineError(
                f"{self.name}: cannot be opened: {reason}; is the adapter plugged in, do you "
                "have permission for the port, and does no other program use it?"
            ) from None
        self._channel = ByteChannel(self._clock, self._port.fileno())
        return self._channel

    def close(self) -> None:
        """Close the port; a later request opens it again."""
        if self._channel is not None:
            self._channel.close()
            self._channel = None
            self._port.close()

    def registers(
        self, kind: Literal["input", "holding"], unit: int, start: int, count: int
    ) -> list[int]:
        """Return `count` registers of one unit from address `start` on."""
        request = _READS[kind](dev_id=unit, address=start, count=count)
        last = f" to {start + count - 1}" if count > 1 else ""
        what = f"{kind} register{'s' * (count > 1)} {start}{last}"
        answer = self._ask(unit, what, request)
        if len(answer.registers) != count:
            raise self._wrong(
                unit, what, f"{len(answer.registers)} registers arrived; expected: {count}"
            )
        return list(answer.registers)

    def write_register(self, unit: int, address: int, value: int) -> None:
        """Set one holding register of one unit."""
        what = f"set holding register {address} to {value}"
        request = WriteSingleRegisterRequest(dev_id=unit, address=address, registers=[value])
        self._ask(unit, what, request)

    def _ask(self, unit: int, what: str, request: ModbusPDU) -> ModbusPDU:
        retries = self._retries if self.retrying else 0
        for left in range(retries, -1, -1):
            try:
                return self._ask_once(unit, what, request)
            except LineError:
                raise
            except ModbusError:
                if left == 0:
                    raise
                self.repeated += 1
        raise AssertionError  # not reached: the last attempt returns or raises

    def _ask_once(self, unit: int, what: str, request: ModbusPDU) -> ModbusPDU:
        channel, code, clock = self.open(), request.function_code, self._clock
        question, asked_s = self._framer.buildFrame(request), clock.now_s
        data = channel.ask(question, lambda data: len(data) >= _size(data, code), self._timeout_s)
        if channel.lost:
            self.close()
            raise LineError(f"{self.name}: the serial port is gone; was the adapter unplugged?")
        if clock.lockstep:
            taken_s = (len(question) + len(data)) * self._byte_s + _TURNAROUND_S
            clock.wait(None, asked_s + taken_s)
        answer = answer_in(data, self._framer, unit)
        if answer is None or answer.function_code & 0x7F != code:
            reason = self._missing_answer_reason(data, unit, code)
            if len(data) > 3 and question.startswith(data[: len(question)]):
                reason = "the adapter returns what it sends: switch off its echo (local echo)"
            raise self._wrong(unit, what, reason)
        if isinstance(answer, ExceptionResponse):
            raise self._wrong(unit, what, refusal(answer))
        return answer

    def _missing_answer_reason(self, data: bytes, unit: int, code: int) -> str:
        if not data:
            return (
                f"no answer within {self._timeout_s:g} s; check its power, its unit id, baud "
                "rate and parity of the line, and whether A and B are exchanged"
            )
        whole = _size(data, code)
        if len(data) < whole:
            return f"the answer was cut off after {len(data)} of {whole} bytes"
        if not FramerRTU.check_CRC(data[: whole - 2], int.from_bytes(data[whole - 2 : whole])):
            return "the answer's checksum (CRC) is wrong; check shield, termination, baud rate"
        if data[0] != unit:
            return f"unit {data[0]} answered; are two amplifiers or their ids exchanged?"
        return f"the answer is invalid ({data[:16].hex(' ')})"

    def _wrong(self, unit: int, what: str, reason: str) -> ModbusError:
        return ModbusError(f"{self.name}: unit {unit}: {what}: {reason}")


def _size(data: bytes, code: int) -> int:
    """Return the length of an answer that begins with `data`, or the part of it known so far."""
    if len(data) > 1 and data[1] & 0x80:
        return _EXCEPTION_BYTES
    if code in _READ_CODES and len(data) > 2 and data[1] == code:
        return 5 + data[2]
    return _ECHO_BYTES
