"""One RS-485 line with Modbus RTU: requests to its units that succeed or say in words why not."""

from __future__ import annotations

import os
import struct
import termios
from collections.abc import Callable
from pathlib import Path
from typing import Any, Final, Literal

import serial  # type: ignore[import-untyped]
from pymodbus.client import ModbusSerialClient
from pymodbus.exceptions import ConnectionException, ModbusException
from pymodbus.framer.rtu import FramerRTU

from drivers.modbus.tcp import ModbusError, exception_text

_READ_CODES: Final = {"holding": 3, "input": 4}


class LineError(ModbusError):
    """The serial port itself cannot be opened or is gone."""


class _Client(ModbusSerialClient):
    """Receives by the monotonic clock: the library's own time-out follows a clock that is set."""

    def recv(self, size: int | None) -> bytes:
        """Return what has come; nothing where the time-out passes first."""
        del size  # the library asks for whatever there is
        port = self.socket
        if port is None:
            raise ConnectionException(f"{self.comm_params.host}: not open")
        try:
            first: bytes = port.read(1)
            return first + bytes(port.read(port.in_waiting))
        except OSError:
            self.close()  # type: ignore[no-untyped-call]
            raise ConnectionException(f"{self.comm_params.host}: gone") from None


class ModbusLine:
    """Requests over one serial port; opens it by itself, anew after the port was lost.

    Not for several threads at once. Every method raises ModbusError, which names port, unit,
    request and reason (LineError where it is the port's).
    """

    def __init__(
        self,
        port: str,
        baudrate: int,
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
            "timeout": timeout_s,
            "write_timeout": max(timeout_s, 1.0),
            "exclusive": True,
        }
        self._timeout_s = timeout_s
        self._retries = retries
        self._received = b""
        self.repeated = 0
        """Requests that had to be repeated so far."""
        self.patient = True
        """Whether a request that failed is repeated."""
        self._client = _Client(
            port,
            baudrate=baudrate,
            parity=parity,
            stopbits=stop_bits,
            timeout=timeout_s,
            retries=0,
            trace_packet=self._trace,
        )

    def open(self) -> None:
        """Open the port; raises LineError. Done by the first request where it was not before."""
        if self._client.socket is not None:
            return
        try:
            self._client.socket = serial.Serial(self.name, **self._settings)
        except (OSError, ValueError, termios.error) as error:  # SerialException is an OSError
            number = getattr(error, "errno", None) or error.args[0]
            reason = os.strerror(number) if isinstance(number, int) else str(error)
            raise LineError(
                f"{self.name}: cannot be opened: {reason}; is the adapter plugged in, the port "
                "yours to use, and no other program at it?"
            ) from None

    def close(self) -> None:
        """Close the port; a later request opens it again."""
        self._client.close()  # type: ignore[no-untyped-call]

    def registers(
        self, kind: Literal["input", "holding"], unit: int, start: int, count: int
    ) -> list[int]:
        """Return `count` registers of one unit from address `start` on."""
        read: Callable[..., Any] = (
            self._client.read_input_registers
            if kind == "input"
            else self._client.read_holding_registers
        )
        last = f" to {start + count - 1}" if count > 1 else ""
        what = f"{kind} register{'s' * (count > 1)} {start}{last}"
        answer = self._ask(unit, what, _READ_CODES[kind], read, start, count=count)
        if len(answer.registers) != count:
            raise self._wrong(unit, what, f"{len(answer.registers)} registers came, not {count}")
        return [int(value) for value in answer.registers]

    def write_register(self, unit: int, address: int, value: int) -> None:
        """Set one holding register of one unit."""
        what = f"set holding register {address} to {value}"
        self._ask(unit, what, 6, self._client.write_register, address, value)

    def _ask(
        self, unit: int, what: str, code: int, request: Callable[..., Any], *args: Any, **named: Any
    ) -> Any:
        retries = self._retries if self.patient else 0
        for left in range(retries, -1, -1):
            try:
                return self._ask_once(unit, what, code, request, *args, **named)
            except LineError:
                raise
            except ModbusError:
                if left == 0:
                    raise
                self.repeated += 1
        raise AssertionError  # not reached: the last attempt returns or raises

    def _ask_once(
        self, unit: int, what: str, code: int, request: Callable[..., Any], *args: Any, **named: Any
    ) -> Any:
        self.open()
        self._received = b""
        try:
            answer = request(*args, **named, device_id=unit)
        except ModbusException:
            if self._client.socket is None:
                raise LineError(
                    f"{self.name}: the serial port is gone; was the adapter pulled out?"
                ) from None
            raise self._wrong(unit, what, self._why_no_answer(unit, code)) from None
        except (OSError, ValueError, IndexError, struct.error) as error:
            raise self._wrong(unit, what, f"the answer makes no sense ({error})") from None
        if answer.isError():
            number = int(getattr(answer, "exception_code", 0))
            raise self._wrong(
                unit, what, f"refused with exception {number} ({exception_text(number)})"
            )
        return answer

    def _trace(self, sending: bool, data: bytes) -> bytes:
        if not sending:
            self._received = data
        return data

    def _why_no_answer(self, unit: int, code: int) -> str:
        data = self._received
        if not data:
            return (
                f"no answer within {self._timeout_s:g} s; is it powered, its unit id and the "
                "line's baud rate and parity right, A and B not exchanged?"
            )
        whole = 5 if len(data) > 1 and data[1] & 0x80 else 8
        if code in _READ_CODES.values() and len(data) > 2 and data[1] == code:
            whole = 5 + data[2]
        if len(data) < whole:
            return f"the answer was cut off after {len(data)} of {whole} bytes"
        if not FramerRTU.check_CRC(data[: whole - 2], int.from_bytes(data[whole - 2 : whole])):
            return "the answer's checksum (CRC) is wrong; check shield, termination, baud rate"
        if data[0] != unit:
            return f"unit {data[0]} answered; have two amplifiers changed places or ids?"
        return f"the answer makes no sense ({data[:16].hex(' ')})"

    def _wrong(self, unit: int, what: str, reason: str) -> ModbusError:
        return ModbusError(f"{self.name}: unit {unit}: {what}: {reason}")
