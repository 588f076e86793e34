"""Modbus RTU master on one RS-485 line."""

from __future__ import annotations

import os
import termios
from pathlib import Path
from typing import Any, Final, Literal

import serial  # type: ignore[import-untyped]
from pymodbus.framer.rtu import FramerRTU
from pymodbus.pdu import (
    DecodePDU,
    ExceptionResponse,
    ModbusPDU,
    ReadHoldingRegistersRequest,
)
from pymodbus.pdu.register_message import ReadInputRegistersRequest, WriteSingleRegisterRequest

from cdpr_drivers.modbus.byte_channel import ByteChannel
from cdpr_drivers.modbus.tcp import ModbusError, answer_in, refusal
from cdpr_rt.core.clock import Clock

_READS: Final[dict[str, type[ModbusPDU]]] = {
    "holding": ReadHoldingRegistersRequest,
    "input": ReadInputRegistersRequest,
}
_READ_CODES: Final = (3, 4)
_EXCEPTION_BYTES, _ECHO_BYTES = 5, 8
_TURNAROUND_S: Final = 0.001
"""What a device takes to answer, besides the time on the wire."""


class LineError(ModbusError):
    """The serial port itself cannot be opened or is gone."""


class ModbusLine:
    """Requests over one serial port; opens it by itself, anew after the port was lost.

    For one task of `clock` at a time. Every method raises ModbusError, which names port, unit,
    request and reason (LineError where it is the port's). In lockstep an answer takes its time on
    the wire by `clock`: it is that of the instant of the question, and returned when it would have
    come.
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
            # a pseudo-terminal has no parity, and takes the wish for one badly
            "parity": "N" if Path(port).resolve().is_relative_to("/dev/pts") else parity,
            "stopbits": stop_bits,
            "exclusive": True,
            # VMIN 1: a read that finds nothing differs from a port that is gone
            "inter_byte_timeout": 0,
        }
        self._clock = clock
        self._byte_s = (9 + stop_bits + (parity != "N")) / baudrate
        self._timeout_s = timeout_s
        self._retries = retries
        self.repeated = 0
        """Requests that had to be repeated so far."""
        self.retrying = True
        """Whether a request that failed is repeated."""
        self._framer = FramerRTU(DecodePDU(False))
        self._port: Any = None
        self._channel: ByteChannel | None = None

    def open(self) -> ByteChannel:
        """Open the port, where it is not; the first request does too. Raises LineError."""
        if self._channel is not None:
            return self._channel
        try:
            self._port = serial.Serial(self.name, **self._settings)
        except (OSError, ValueError, termios.error) as error:  # SerialException is an OSError
            number = getattr(error, "errno", None) or error.args[0]
            reason = os.strerror(number) if isinstance(number, int) else str(error)
            raise LineError(
                f"{self.name}: cannot be opened: {reason}; is the adapter plugged in, the port "
                "yours to use, and no other program at it?"
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
            raise self._wrong(unit, what, f"{len(answer.registers)} registers came, not {count}")
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
            raise LineError(f"{self.name}: the serial port is gone; was the adapter pulled out?")
        if clock.lockstep:
            taken_s = (len(question) + len(data)) * self._byte_s + _TURNAROUND_S
            clock.wait(None, asked_s + taken_s)
        answer = answer_in(data, self._framer, unit)
        if answer is None or answer.function_code & 0x7F != code:
            raise self._wrong(unit, what, self._missing_answer_reason(data, unit, code))
        if isinstance(answer, ExceptionResponse):
            raise self._wrong(unit, what, refusal(answer))
        return answer

    def _missing_answer_reason(self, data: bytes, unit: int, code: int) -> str:
        if not data:
            return (
                f"no answer within {self._timeout_s:g} s; is it powered, its unit id and the "
                "line's baud rate and parity right, A and B not exchanged?"
            )
        whole = _size(data, code)
        if len(data) < whole:
            return f"the answer was cut off after {len(data)} of {whole} bytes"
        if not FramerRTU.check_CRC(data[: whole - 2], int.from_bytes(data[whole - 2 : whole])):
            return "the answer's checksum (CRC) is wrong; check shield, termination, baud rate"
        if data[0] != unit:
            return f"unit {data[0]} answered; have two amplifiers changed places or ids?"
        return f"the answer makes no sense ({data[:16].hex(' ')})"

    def _wrong(self, unit: int, what: str, reason: str) -> ModbusError:
        return ModbusError(f"{self.name}: unit {unit}: {what}: {reason}")


def _size(data: bytes, code: int) -> int:
    """Return how many bytes an answer has that begins with `data`, as far as is known."""
    if len(data) > 1 and data[1] & 0x80:
        return _EXCEPTION_BYTES
    if code in _READ_CODES and len(data) > 2 and data[1] == code:
        return 5 + data[2]
    return _ECHO_BYTES
