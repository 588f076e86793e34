"""Values of objects as text and in SI units, as far as the drive's profile and ratings allow."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache, lru_cache
from pathlib import Path
from typing import Any, Final

import canopen
from canopen.objectdictionary import ODVariable, datatypes

from cdpr_drivers.canopen.emergency import register_text
from cdpr_drivers.cia402 import fault_text, mode_name, state_of, supported_modes
from cdpr_drivers.drive_units import torque_unit_Nm, velocity_unit_rad_s
from cdpr_profiles import DriveProfile, load_drive
from cdpr_profiles.eds import load_dictionary

# Names and types of objects, from electronic data sheets.

_STANDARD_DRIVE = "generic-cia402"
_SIGNED = frozenset(datatypes.SIGNED_TYPES)
_INTEGERS = frozenset(datatypes.INTEGER_TYPES)
_LONGEST_INTEGER = 8


class ObjectNames:
    """Names of objects from an EDS; for objects it lacks, from the generic CiA 402 EDS."""

    def __init__(self, eds: Path | None = None) -> None:
        self._device = _dictionary(eds) if eds is not None else None
        self._standard = _standard()

    def name(self, index: int, sub: int) -> str:
        """Return an object's name; "" if no data sheet has it."""
        for dictionary in (self._device, self._standard):
            entry = dictionary.get(index) if dictionary is not None else None
            if entry is None:
                continue
            if isinstance(entry, ODVariable):
                return str(entry.name)
            part = _part(entry, sub)
            if part is None or str(part.name).startswith(str(entry.name)):
                return str((part or entry).name)
            return f"{entry.name}: {part.name}"
        return ""

    def decode(self, index: int, sub: int, raw: bytes) -> Any:
        """Return an object's value by its type; an integer if no data sheet has it.

        Bytes that do not fit the type are returned unchanged.
        """
        variable = self._variable(index, sub)
        if variable is not None and variable.data_type not in _INTEGERS:
            try:
                return variable.decode_raw(raw)
            except canopen.ObjectDictionaryError:
                return raw
        if not 0 < len(raw) <= _LONGEST_INTEGER:
            return raw
        signed = variable is not None and variable.data_type in _SIGNED
        return int.from_bytes(raw, "little", signed=signed)

    def _variable(self, index: int, sub: int) -> ODVariable | None:
        for dictionary in (self._device, self._standard):
            entry = dictionary.get(index) if dictionary is not None else None
            found = entry if isinstance(entry, ODVariable) or entry is None else _part(entry, sub)
            if found is not None:
                return found
        return None


def _part(entry: Any, sub: int) -> ODVariable | None:
    """Return a member of a record or array; the library's arrays create members on demand."""
    try:
        return entry[sub]  # type: ignore[no-any-return]
    except KeyError:
        return None


@lru_cache(maxsize=32)
def _dictionary(eds: Path) -> Any:
    return load_dictionary(eds)


@cache
def _standard() -> Any:
    return _dictionary(load_drive(_STANDARD_DRIVE).eds)


_POSITIONS = frozenset(
    (0x6062, 0x6064, 0x6067, 0x607A, 0x607C, 0x60E4, 0x60F4, *range(0x60BA, 0x60BE))
)
_VELOCITIES = frozenset((0x606B, 0x606C, 0x60FF))
_SPEEDS = frozenset((0x607F, 0x6081, 0x6082, 0x6099))
"""Objects that hold speeds, without a sign; 6099h is a record of two."""
_TORQUES = frozenset((0x6071, 0x6074, 0x6077, 0x60B2))
_TORQUE_LIMITS = frozenset((0x6072, 0x60E0, 0x60E1))
_HOMING, _CYCLIC = 6, (8, 9, 10)
_RELATIVE_TORQUE_UNITS = {
    "per_mille_of_rated": "per mille of rated",
    "percent_of_rated": "percent of rated",
    "mA_rms": "mA",
    "mA_peak": "mA (peak)",
}
_SHOWN_BYTES = 32
_MICRO, _MILLI = 1e-6, 1e-3
_PDO_PARAMETERS = ((0x1400, 0x1600), (0x1800, 0x1A00))
_PDO_MAPS = ((0x1600, 0x1800), (0x1A00, 0x1C00))


@dataclass(frozen=True)
class DecodedValue:
    """One value in a frame."""

    index: int
    sub: int
    name: str
    raw: bytes
    value: float | str
    """Value in `unit`; text if the object is a word of bits or a name."""
    unit: str
    text: str

    def __str__(self) -> str:
        return f"{self.name or f'{self.index:04X}h:{self.sub}'} {self.text}"


@dataclass
class NodeView:
    """What is known about one node; its traffic adds to it."""

    node_id: int
    names: ObjectNames
    drive: DriveProfile | None = None
    rated_torque_Nm: float | None = None
    counts_per_turn: int | None = None
    torque_constant_Nm_per_Arms: float = 0.0
    mode: int | None = None

    def torque_Nm(self) -> float | None:
        """Motor torque of one unit of 6077h, with the drive's sign; None if unknown."""
        if self.drive is None:
            return None
        constant = self.torque_constant_Nm_per_Arms
        unit_Nm = torque_unit_Nm(self.drive, self.rated_torque_Nm or 0.0, constant)
        return self.drive.torque_sign * unit_Nm if unit_Nm > 0.0 else None

    def position_rad(self) -> float | None:
        """Motor angle of one unit of 6064h, with the drive's sign; None if unknown."""
        if self.drive is None or not self.counts_per_turn:
            return None
        return self.drive.position_sign * math.tau / self.counts_per_turn

    def velocity_rad_s(self) -> float | None:
        """Motor speed of one unit of 606Ch, with the drive's sign; None if unknown."""
        if self.drive is None or not (self.counts_per_turn or self.drive.velocity_unit == "rpm"):
            return None
        unit = velocity_unit_rad_s(self.drive, self.counts_per_turn or 1)
        return self.drive.position_sign * unit


def read_field(node: NodeView, index: int, sub: int, raw: bytes) -> DecodedValue:
    """Return the meaning of an object's bytes on this node; accepts any bytes."""
    name = node.names.name(index, sub)
    number = node.names.decode(index, sub, raw)
    if type(number) is not int:
        text = _other(number)
        return DecodedValue(index, sub, name, raw, text, "", text)
    quantity = _quantity(node, index, sub)
    if quantity is not None:
        scale, unit, digits = quantity
        value = number * scale
        return DecodedValue(
            index, sub, name, raw, value, unit, f"{value:.{digits}f} {unit}".rstrip()
        )
    words = _words(node, index, sub, number)
    if words is not None:
        return DecodedValue(index, sub, name, raw, words, "", words)
    return DecodedValue(index, sub, name, raw, float(number), "", _integer(number))


def _integer(number: int) -> str:
    return f"{number} ({number:X}h)" if number > 9 else str(number)


def _other(value: object) -> str:
    if isinstance(value, str):
        return repr(value)
    if isinstance(value, bytes | bytearray):
        shown = value[:_SHOWN_BYTES].hex(" ").upper() or "(nothing)"
        return shown if len(value) <= _SHOWN_BYTES else f"{shown} ... ({len(value)} bytes)"
    return str(value)


def _quantity(node: NodeView, index: int, sub: int) -> tuple[float, str, int] | None:
    """Return scale, unit and number of digits of an object that is a physical quantity."""
    if _within(index, _PDO_PARAMETERS):
        return _PDO_TIMES.get(sub)
    if index in _POSITIONS:
        scale = node.position_rad()
        return (1.0, "counts", 0) if scale is None else (math.degrees(scale), "deg", 3)
    if index in _VELOCITIES or (index in _SPEEDS and (sub or index != 0x6099)):
        scale = node.velocity_rad_s()
        if scale is not None and index in _SPEEDS:
            scale = abs(scale)
        return None if scale is None else (math.degrees(scale), "deg/s", 3)
    if index in _TORQUES:
        return _torque(node)
    if index in _TORQUE_LIMITS:
        scale, unit, digits = _torque(node)
        return abs(scale), unit, digits
    return _FIXED.get(index)


def _torque(node: NodeView) -> tuple[float, str, int]:
    scale = node.torque_Nm()
    if scale is not None:
        return scale, "Nm", 4
    unit = node.drive.torque_unit if node.drive is not None else "per_mille_of_rated"
    return 1.0, _RELATIVE_TORQUE_UNITS[unit], 0


_PDO_TIMES = {3: (0.1, "ms", 1), 5: (1.0, "ms", 0)}
"""Inhibit time and event timer of a PDO, by sub-index."""
_FIXED: dict[int, tuple[float, str, int]] = {
    0x1006: (1e3 * _MICRO, "ms", 3),
    0x1017: (1.0, "ms", 0),
    0x6075: (_MILLI, "A", 3),
    0x6076: (_MILLI, "Nm", 3),
    0x6073: (0.1, "% of rated current", 1),
    0x6078: (0.1, "% of rated current", 1),
    0x6079: (_MILLI, "V", 3),
}


def _within(index: int, ranges: tuple[tuple[int, int], ...]) -> bool:
    return any(low <= index < high for low, high in ranges)


def _words(node: NodeView, index: int, sub: int, number: int) -> str | None:
    """Return the text of an object that is a word of bits or a code; None for other objects."""
    known = _WORDS.get(index)
    if known is not None:
        return known(number)
    if index in _STATE_WORDS:
        return _STATE_WORDS[index](number & 0xFFFF, node.mode)
    if _within(index, _PDO_PARAMETERS) and sub == 1:
        return f"{number & 0x7FF:03X}h{', off' if number >> 31 & 1 else ''}"
    if _within(index, _PDO_MAPS) and sub:
        return f"{number >> 16:04X}h:{number >> 8 & 0xFF}, {number & 0xFF} bits"
    return _PARTS[index](number) if index in _PARTS and sub else None


def _watched(number: int) -> str:
    return f"node {number >> 16 & 0x7F} within {number & 0xFFFF} ms" if number else "nobody"


def _device_type(number: int) -> str:
    return f"CiA {number & 0xFFFF} ({number:08X}h)" if number & 0xFFFF else f"{number:08X}h"


def _error_field(number: int) -> str:
    return fault_text(number & 0xFFFF) if number & 0xFFFF else "no error"


def _modes(number: int) -> str:
    return ", ".join(mode_name(mode) for mode in supported_modes(number)) or "none"


_PARTS: dict[int, Callable[[int], str]] = {
    0x1003: _error_field,
    0x1016: _watched,
    0x1018: lambda number: f"{number:08X}h",
}
_WORDS: dict[int, Callable[[int], str]] = {
    0x1000: _device_type,
    0x1001: lambda number: register_text(number & 0xFF),
    0x603F: _error_field,
    0x6060: mode_name,
    0x6061: mode_name,
    0x6502: _modes,
}

_STATUS_BITS = ((7, "warning"), (10, "target reached"), (11, "internal limit"))


STATUSWORD_BITS: Final = (
    "ready to switch on", "switched on", "operation enabled", "fault", "voltage enabled",
    "no quick stop", "switch on disabled", "warning", "manufacturer, bit 8", "remote",
    "target reached", "internal limit", "mode, bit 12", "mode, bit 13", "manufacturer, bit 14",
    "manufacturer, bit 15",
)  # fmt: skip
"""Meaning of each bit of a statusword that is set, from bit 0 (CiA 402-2)."""


@lru_cache(maxsize=4096)
def statusword_text(word: int, mode: int | None = None) -> str:
    """Return a statusword as text; bits that depend on the mode need `mode` (6061h)."""
    words = [state_of(word).label]
    words += [name for bit, name in _STATUS_BITS if word >> bit & 1]
    if not word >> 9 & 1:
        words.append("not remote")
    if mode == _HOMING:
        words += [name for bit, name in ((12, "homed"), (13, "homing error")) if word >> bit & 1]
    elif mode in _CYCLIC:
        words += ["follows commands"] if word >> 12 & 1 else []
        words += ["following error"] if word >> 13 & 1 and mode == 8 else []
    return f"{', '.join(words)} ({word:04X}h)"


@lru_cache(maxsize=4096)
def controlword_text(word: int, mode: int | None = None) -> str:
    """Return the command in a controlword as text."""
    if word & 0x80:
        command = "fault reset"
    elif not word & 0x02:
        command = "disable voltage"
    elif not word & 0x04:
        command = "quick stop"
    elif not word & 0x01:
        command = "shutdown"
    else:
        command = "enable operation" if word & 0x08 else "switch on"
    if mode == _HOMING and word & 0x10:
        command += ", start homing"
    if word & 0x100:
        command += ", halt"
    return f"{command} ({word:04X}h)"


_STATE_WORDS: dict[int, Callable[[int, int | None], str]] = {
    0x6040: controlword_text,
    0x6041: statusword_text,
}
