"""Quirks of the simulated drives: deviations of each manufacturer's firmware from CiA 402.

They are chosen by the drive's identity (1018h), and not by the profiles that a master reads. So an
error in a profile shows on the bus.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum, auto
from functools import cache
from pathlib import Path

import cdpr_profiles
from cdpr_sim_bus.canopen.abort import Abort, SdoAbort
from cdpr_sim_bus.canopen.od import APPLICATION, Codec, Entry, ObjectDictionary
from cdpr_sim_bus.cia402.words import ModeNumber

_STANDARD_EDS = Path(cdpr_profiles.__file__).parent / "drives" / "generic-cia402.eds"
_VOLTAGE_ENABLED, _MANUFACTURER_8, _MANUFACTURER_14 = 1 << 4, 1 << 8, 1 << 14
_STANDARD_COUNTS_PER_TURN = 8192
IN_VELOCITY_UNITS = (
    *((index, 0) for index in (0x606D, 0x606F, 0x607F, 0x6081)),
    *((0x6099, 1), (0x6099, 2)),
)
IN_ACCELERATION_UNITS = tuple(
    (index, 0) for index in (0x6083, 0x6084, 0x6085, 0x609A, 0x60C5, 0x60C6)
)


class ModeChange(Enum):
    """When a drive accepts another mode of operation."""

    ANY_TIME = auto()
    NOT_ENABLED = auto()
    """Rejects 6060h while enabled."""
    HALTED = auto()
    """Rejects 6060h while enabled, and ignores it unless the controlword's halt bit is set."""


@dataclass(frozen=True)
class DriveQuirks:
    """Quirks of one drive type's firmware; the defaults are those of CiA 402."""

    torque_unit_Nm: float | None = None
    """Unit of the torque objects; None: per mille of 6076h."""
    torque_in_mA: bool = False
    """Torque objects in mA (rms) of the motor's current, instead of `torque_unit_Nm`."""
    rated_torque_unit_Nm: float = 1e-3
    """Unit of 6076h."""
    velocity_in_rpm: bool = False
    """Velocities in rpm, accelerations in rpm/s; else counts/s and counts/s²."""
    modes: frozenset[int] | None = None
    """Modes of operation; None: those of 6502h."""
    homing_methods: frozenset[int] | None = None
    """Homing methods; None: all of the firmware."""
    mode_change: ModeChange = ModeChange.ANY_TIME
    homing_reversed: bool = False
    """Each homing method moves in the direction opposite to the standard."""
    bit_10_in_homing: bool = True
    """Whether bit 10 (target reached) works in homing mode; else bit 12 is set at standstill."""
    statusword_set: int = 0
    """Bits that are always set."""
    statusword_clear: int = 0
    """Bits that are never set."""
    mode_display_delay_s: float = 0.0
    """Minimum time from a write to 6060h until 6061h shows the mode."""
    enable_delay_s: float = 0.0
    """Minimum time from the enable operation command until the state is reached."""

    def unit_Nm(self, rated_torque_Nm: float, constant_Nm_per_Arms: float) -> float:
        """Return the torque of one unit of the torque objects."""
        if self.torque_in_mA:
            return 1e-3 * constant_Nm_per_Arms
        return self.torque_unit_Nm or 1e-3 * rated_torque_Nm

    def supported_modes(self, announced: int) -> frozenset[int]:
        """Return the modes to which 6060h may be set, including 0 (no mode).

        Some drives report no modes (6502h = 0) and have all modes that their objects allow.
        """
        if self.modes is not None:
            return self.modes | {0}
        if not announced:
            return frozenset(ModeNumber)
        return frozenset({0}) | {n for n in ModeNumber if n and announced >> n - 1 & 1}

    def accepts_mode(self, enabled: bool, halted: bool) -> bool:
        """Return whether a write to 6060h takes effect now; raises SdoAbort if it is rejected."""
        if self.mode_change is ModeChange.ANY_TIME:
            return True
        if enabled:
            raise SdoAbort(Abort.DEVICE_STATE)
        return halted or self.mode_change is ModeChange.NOT_ENABLED


_QUIRKS = {
    (0x00CD9A01, 0x00007A01): DriveQuirks(
        torque_unit_Nm=1e-3,
        velocity_in_rpm=True,
        modes=frozenset({1, 3, 4, 6}),
        homing_methods=frozenset({1, 2, 33, 34, 35}),
        mode_change=ModeChange.HALTED,
        homing_reversed=True,
        bit_10_in_homing=False,
        statusword_set=_MANUFACTURER_8 | _MANUFACTURER_14,
        statusword_clear=_VOLTAGE_ENABLED,
        mode_display_delay_s=0.025,
        enable_delay_s=0.060,
    ),
    (0x00000089, 0x0000C321): DriveQuirks(
        modes=frozenset({1, 3, 4, 6}),
        homing_methods=frozenset({1, 2, 33, 34, 35}),
        mode_change=ModeChange.NOT_ENABLED,
        mode_display_delay_s=0.010,
        enable_delay_s=0.040,
    ),
}


_VENDOR_QUIRKS = {
    # maxon EPOS4: motor rated torque in uNm, velocities in rpm, accelerations in rpm/s
    0x000000FB: DriveQuirks(rated_torque_unit_Nm=1e-6, velocity_in_rpm=True),
    0x00000286: DriveQuirks(torque_in_mA=True),  # Trinamic
}
"""Quirks of all products of a vendor that have no entry in `_QUIRKS`."""


def quirks_of(od: ObjectDictionary) -> DriveQuirks:
    """Return the quirks of the drive with this dictionary, by vendor and product (1018h)."""
    vendor = od.get_int(0x1018, 1)
    usual = _VENDOR_QUIRKS.get(vendor, DriveQuirks())
    return _QUIRKS.get((vendor, od.get_int(0x1018, 2, 0)), usual)


def add_missing_objects(od: ObjectDictionary, quirks: DriveQuirks) -> None:
    """Add the standard objects that the EDS lacks, for the firmware, hidden from the bus.

    Existing objects of the standard's size get its sign, which some EDS files state wrongly.
    """
    scaled = set(IN_VELOCITY_UNITS + IN_ACCELERATION_UNITS) if quirks.velocity_in_rpm else set()
    for model in _standard_objects():
        key = model.index, model.sub
        if key in od:
            _correct_sign(od.entry(*key), model.codec)
            continue
        entry = Entry(*key, model.codec, name=model.name, access=model.access)
        value = model.base_default
        if key in scaled and isinstance(value, int):
            value = min(round(value * 60 / _STANDARD_COUNTS_PER_TURN), model.codec.high or value)
        entry.base_default = entry.default = entry.value = value
        entry.hidden = True
        od.add(entry)


def _correct_sign(entry: Entry, standard: Codec) -> None:
    codec = entry.codec
    if codec.low is None or codec.size != standard.size or codec.low == standard.low:
        return
    entry.codec, entry.low, entry.high = standard, standard.low, standard.high
    entry.base_default = standard.decode(codec.encode(entry.base_default))
    entry.default = entry.value = entry.base_default


@cache
def _standard_objects() -> tuple[Entry, ...]:
    return tuple(e for e in ObjectDictionary.from_eds(_STANDARD_EDS, 1) if e.index in APPLICATION)
