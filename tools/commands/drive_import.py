"""`cdpr drive import`: a drive profile from the manufacturer's EDS or DCF."""

from __future__ import annotations

import dataclasses
import json
import re
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Annotated, Any

import typer

from cdpr_drivers.cia402 import Mode, supported_modes
from cdpr_drivers.drive_units import VELOCITY_UNITS
from cdpr_profiles import load_drive
from cdpr_profiles.bounded_input import read_bytes
from cdpr_profiles.eds import MOST_EDS_BYTES, DataSheet, bits_of, read_eds
from cdpr_profiles.errors import ProfileError
from cdpr_tools.commands.options import JsonOption, argument, option
from cdpr_tools.errors import BadInputError, WorkFailedError, os_error_as
from cdpr_tools.output import Output

_SUFFIXES = (".eds", ".dcf")
_PROFILE_NAME = re.compile(r"[A-Za-z0-9][A-Za-z0-9_.-]{0,63}", re.ASCII)

_MODE_SHOWN, _PROBE_STATUS, _PROBE_POSITION = 0x6061, 0x60B9, 0x60BA
_COMMAND = (0x6040, 0x6071)
_FEEDBACK = (0x6041, 0x6064, 0x6077)
_EXTRA = (_MODE_SHOWN, _PROBE_STATUS, _PROBE_POSITION)
_BITS = {
    **{0x6040: (16,), 0x6071: (16, 32), 0x6041: (16,), 0x6064: (32,), 0x6077: (16, 32)},
    **{_MODE_SHOWN: (8,), _PROBE_STATUS: (16,), _PROBE_POSITION: (32,)},
}
"""Sizes of the objects exchanged in a cycle; a torque with 32 bits deviates from CiA 402."""
_HARMLESS = (*_COMMAND, 0x60B2)
"""Objects allowed in a mapped RPDO; except for the commands, they are sent as zero each cycle."""
_MOST_PDOS = 512
_MOST_NAMED = 4
_FRAME_BITS = 64
_MOST_ENTRIES = 8
_PREDEFINED = 4
_IDENTIFIER, _NODE = 0x7FF, 0x7F
_EVERY_SYNC, _SYNC_WHEN_CHANGED = 1, 0
_IN_PLACE = 0x6098
_DEFAULT_SLOPE_Nm_s = 3000.0
_MANUAL, _ASSUMED = "manual", "assumed"

app = typer.Typer()


@app.command("import")
def import_drive(
    file: Annotated[Path, argument("EDS or DCF of the drive.", metavar="FILE")],
    out_dir: Annotated[Path, option("Folder for the profile.", "--out")] = Path(),
    name: Annotated[
        str | None, option("Name of the profile; default the name of the file.")
    ] = None,
    as_json: JsonOption = False,
) -> None:
    """Make a drive profile from an EDS or DCF file, and list what is missing."""
    out = Output(as_json)
    if file.suffix.lower() not in _SUFFIXES:
        raise BadInputError(f"{file}: allowed: a file *.eds or *.dcf")
    stem = _profile_name(file, name)
    eds = read_eds(file)
    made = propose(eds)
    profile, copy = _write(file, out_dir, stem, made)
    _show(out, eds, made, profile, copy)
    out.result(
        {
            "ok": True,
            "profile": profile,
            "eds": copy,
            "remarks": eds.remarks.texts,
            "facts": {
                key: {"value": made.table[key], "status": status, "how": how}
                for key, (status, how) in made.verified.items()
            },
            "unknown": [dataclasses.asdict(unknown) for unknown in made.unknown],
            "node_id": eds.od.node_id,
            "bitrate_bit_s": eds.od.bitrate,
        }
    )


def _profile_name(file: Path, name: str | None) -> str:
    if name is None:
        name = re.sub(r"[^a-z0-9]+", "-", file.stem.lower()).strip("-") or "drive"
    elif not _PROFILE_NAME.fullmatch(name):
        raise BadInputError(
            f"--name {name}: allowed: up to 64 letters, digits, '_', '.' and '-', the first a "
            "letter or digit"
        )
    return name


def _write(file: Path, folder: Path, stem: str, made: Proposal) -> tuple[Path, Path]:
    """Write the profile and a copy of the EDS; neither replaces an existing file."""
    profile, copy = folder / f"{stem}.toml", folder / f"{stem}{file.suffix.lower()}"
    writes = {profile: profile_text(made, copy.name, file.name).encode("utf-8")}
    if not (copy.exists() and copy.samefile(file)):
        writes[copy] = read_bytes(file, MOST_EDS_BYTES)
    for path in writes:
        if path.exists():
            raise BadInputError(f"{path}: already exists; choose another --name or --out")
    _check(file, made)
    with os_error_as(WorkFailedError, f"{folder}: cannot be written"):
        folder.mkdir(parents=True, exist_ok=True)
        for path, content in writes.items():
            path.write_bytes(content)
    return profile, copy


def _check(file: Path, made: Proposal) -> None:
    """Read the profile as its users will, before anything is written."""
    with TemporaryDirectory() as folder:
        profile, copy = Path(folder) / "drive.toml", Path(folder) / f"drive{file.suffix.lower()}"
        copy.write_bytes(read_bytes(file, MOST_EDS_BYTES))
        profile.write_text(profile_text(made, copy.name, file.name), encoding="utf-8")
        try:
            load_drive(profile)
        except ProfileError as error:
            problem = str(error).removeprefix(f"{profile}: ")
            raise BadInputError(f"{file}: gives no usable profile: {problem}") from error


def _show(out: Output, eds: DataSheet, made: Proposal, profile: Path, copy: Path) -> None:
    texts = eds.remarks.texts
    if texts:
        count = len(texts) + eds.remarks.omitted
        out.say(f"{eds.path}: {count} remark{'s' * (count != 1)}")
        for text in texts:
            out.say(f"  {text}")
        out.say("")
    for key, (status, how) in made.verified.items():
        out.say(f"{key:23} {_shown(key, made.table[key]):43} {status}: {how}")
    out.say("")
    out.say("Not in the file:")
    for unknown in made.unknown:
        out.say(f"  {unknown.what}")
        out.say(f"      {unknown.why}")
        out.say(f"      to find out: {unknown.how}")
    out.say("")
    suggested = {"node_id": eds.od.node_id, "bitrate_bit_s": eds.od.bitrate}
    if values := ", ".join(f"{key} = {one}" for key, one in suggested.items() if one is not None):
        out.say(f"for the winch's file: {values}")
    out.say(f"{copy}: the manufacturer's file")
    out.say(f"{profile}: name it as `drive` in your winch's file")


def _shown(key: str, value: Any) -> str:
    if key in ("rpdos", "tpdos"):
        return "; ".join(
            f"{pdo['number']}: " + " ".join(f"{e['index']:04X}h" for e in pdo["entries"])
            for pdo in value
        )
    if key in ("vendor_id", "product_code", "revision"):
        return f"{value:08X}h"
    return " ".join(map(str, value)) if isinstance(value, list) else str(value)


# The facts about a drive that an EDS contains, and those that the user must find out.


@dataclass(frozen=True)
class Unknown:
    """A fact that no EDS contains, why it matters, and how to find it out."""

    what: str
    why: str
    how: str


@dataclass
class Proposal:
    """A drive profile in preparation: its keys, their sources, and the unknown facts."""

    table: dict[str, Any]
    verified: dict[str, tuple[str, str]] = field(default_factory=dict)
    """Status and source of each key."""
    unknown: list[Unknown] = field(default_factory=list)

    def set(self, key: str, value: Any, status: str, how: str) -> None:
        """Set a key, with the source of its value."""
        self.table[key] = value
        self.verified[key] = status, how

    def find_out(self, *topics: str) -> None:
        """Add facts that the user must find out, by their names in the list of topics."""
        self.unknown += [_TOPICS[topic] for topic in topics]


_LOOK = "`cdpr drive od WINCH {} --bus URL` reads it"
_REFUSES = "the boot rejects a drive whose identity differs"
_SCAN = "`cdpr bus scan --bus URL` shows it; write it into the profile"
_TOPICS = {
    **{
        key: Unknown(f"{key} (1018h:{sub})", _REFUSES, _SCAN)
        for sub, key in enumerate(("vendor_id", "product_code", "revision"), 1)
    },
    "firmware": Unknown(
        "revision of your drive",
        "a drive may have newer firmware than the EDS, which the boot rejects (step N)",
        "`cdpr bus scan --bus URL`; ask the manufacturer whether the EDS is for that firmware",
    ),
    "modes": Unknown(
        "modes of operation",
        "the EDS has no value of 6502h; the modes are guessed from the objects in it",
        _LOOK.format("6502") + ", bit 3 is PT, bit 9 CST",
    ),
    "slope": Unknown(
        "torque_slope_Nm_s (6087h)",
        "in PT the torque follows a ramp, which delays the control loop",
        "the steepest slope that 6087h accepts: manual, or upper limit in the EDS",
    ),
    "homing": Unknown(
        "homing methods",
        "the EDS has no list of them (60E3h)",
        "manual; `cdpr drive home WINCH --method 34 --bus URL` shows whether it accepts one",
    ),
    "torque_unit": Unknown(
        "torque_unit (6071h, 6077h)",
        "a wrong one makes every torque wrong by a factor",
        "manual (a drive without 6076h often uses mNm); compare 6077h with the current "
        "in 6078h while the motor is held",
    ),
    "other_units": Unknown(
        "velocity_unit, acceleration_unit (6099h, 609Ah)",
        "a wrong one makes homing run too fast or too slow",
        "manual; watch 606Ch while the shaft is turned by hand",
    ),
    "position_sign": Unknown(
        "position_sign",
        "the controller must know the direction in which 6064h counts",
        "turn the shaft by hand in the positive direction; "
        + _LOOK.format("6064")
        + ", it must grow",
    ),
    "torque_sign": Unknown(
        "torque_sign",
        "with the wrong sign the motor runs away at the first motion, and is stopped",
        "`cdpr drive jog WINCH --bus URL` on a free shaft: it ends if something is wrong",
    ),
    "homing_sign": Unknown(
        "homing_sign",
        "method 34 must turn in the direction in which the position grows",
        "`cdpr drive home WINCH --method 34 --bus URL` on a free shaft",
    ),
    "quirks": Unknown(
        "quirks: halt before a change of mode, homing without bit 10",
        "drives deviate from the standard in these points",
        "manual; the command reports a mode that is never confirmed",
    ),
    "rated_torque": Unknown(
        "rated torque (6076h)",
        "torques are per mille of it, and the boot compares it with the motor's",
        _LOOK.format("6076") + "; in mNm, set by the drive's own setup program",
    ),
    "delays": Unknown(
        "feedback_delay_s, torque_delay_s",
        "the compensation looks ahead by these delays",
        "manual: cycle of the position and current loop; if they are wrong, the "
        "commissioning report shows an error that grows with speed",
    ),
    "timeouts": Unknown(
        "state_timeout_s, mode_display_timeout_s",
        "drives with a brake or a slow power stage need longer",
        "manual; `cdpr drive enable WINCH --bus URL` shows which state was not reached",
    ),
    "mode_display": Unknown(
        "mode display in a PDO",
        "no PDO maps 6061h, so the master reads the mode by SDO",
        "nothing to do; a TPDO with 6061h is quicker",
    ),
    "touch_probe": Unknown(
        "touch probe (60B8h, 60B9h, 60BAh)",
        "not mapped: the index can be found only by homing",
        "manual: the zero pulse as source of the touch probe",
    ),
}
_ASSUMPTIONS = {
    "torque_unit": ("per_mille_of_rated", "as CiA 402-2 defines it for 6071h"),
    "rated_torque_unit": ("mNm", "as CiA 402-2 defines it; the boot compares 6076h with the motor"),
    "velocity_unit": ("counts_per_s", "as CiA 402-2 defines it without scaling"),
    "acceleration_unit": ("counts_per_s2", "as CiA 402-2 defines it without scaling"),
    "position_sign": (1, "no EDS states it"),
    "torque_sign": (1, "no EDS states it"),
    "homing_sign": (1, "no EDS states it"),
    "mode_display_timeout_s": (0.5, "generous"),
    "state_timeout_s": (1.0, "generous"),
    "feedback_delay_s": (0.0005, "usual for a drive that samples at 2 kHz"),
    "torque_delay_s": (0.00032, "first-order lag of a 500 Hz current loop"),
    "heartbeat_producer_s": (0.1, "our choice, written to 1017h"),
    "heartbeat_consumer_s": (0.5, "our choice, written to 1016h"),
}
_MAKERS = {
    0x000000FB: {
        "rated_torque_unit": ("uNm", _MANUAL, "maxon: Motor rated torque of the EPOS4 is in uNm")
    },
    0x00000286: {
        "torque_unit": (
            "mA_rms",
            _ASSUMED,
            "Trinamic: mA, assumed to be rms; if they are peak values, the motor's torque is 0.71 "
            "of each command, and `cdpr tension calibrate` shows a gain 41 % above the "
            "geometric one: then write mA_peak",
        )
    },
}
"""Keys that hold for all drives of a manufacturer, by vendor id."""
_CONSEQUENCES = {
    0x1006: "the drive does not know the cycle's period",
    0x1008: "the boot cannot show the device's name",
    0x1016: "the drive does not detect the loss of the master: find out what stops the "
    "drive in that case",
    0x1017: "the drive sends no heartbeat: the master cannot supervise it (step K)",
    0x6007: "the reaction to the loss of the master is not set: manual",
    0x603F: "faults are reported without a code",
    0x605A: "the reaction to quick stop is not set: manual",
    0x6072: "only the master limits the torque, not the drive",
    0x6076: "the motor's rated torque is taken from its profile",
    0x608F: "the encoder's resolution is taken from the winch's file",
}


def propose(eds: DataSheet) -> Proposal:
    """Return the profile of the drive that an EDS describes.

    Raises ProfileError for a drive that cannot be run in a torque mode over its PDOs.
    """
    eds.require(0x1018, "every CANopen device has this object")
    for index in (*_COMMAND, *_FEEDBACK):
        eds.require(index, "torque control needs it")
        entry = eds.get(index)
        if entry is None or bits_of(entry) not in _BITS[index]:
            has = (
                "is not a variable"
                if entry is None
                else (f"value 0x{entry.data_type:04X} has {bits_of(entry)} bits")
            )
            allowed = " or ".join(map(str, _BITS[index]))
            problem = f"{has}; allowed: one of {allowed} bits"
            raise ProfileError(eds.path, f"[{index:04X}] DataType", problem)
    for index in (0x6060, _MODE_SHOWN):
        eds.require(index, "without it no mode of operation can be chosen and confirmed")
    made = Proposal({"name": _name(eds)})
    _identity(made, eds)
    _modes(made, eds)
    _homing(made, eds)
    for key, (value, how) in _ASSUMPTIONS.items():
        made.set(key, value, _ASSUMED, how)
    _units(made, eds)
    made.find_out("torque_unit", "position_sign", "torque_sign", "homing_sign")
    made.find_out("quirks", *([] if _number(eds, 0x6076) else ["rated_torque"]))
    made.find_out("delays", "timeouts")
    _pdos(made, eds)
    for index, why in _CONSEQUENCES.items():
        if index not in eds.od.indices:
            what = f"{index:04X}h is not in the EDS"
            made.unknown.append(Unknown(what, why, "ask the manufacturer, or get a newer EDS"))
    return made


def _number(eds: DataSheet, index: int, sub: int = 0) -> int | None:
    """Return an integer from the file, without the node id: a DCF's value, else the default."""
    entry = eds.get(index, sub)
    if entry is None:
        return None
    value = entry.default if entry.value is None else entry.value
    is_pdo_id = sub == 1 and (0x1400 <= index < 0x1600 or 0x1800 <= index < 0x1A00)
    has_value = entry.value is not None and (index, sub) not in eds.relative_values
    if is_pdo_id and has_value and isinstance(value, int):
        value -= eds.od.node_id or 0  # identifiers in a DCF may include its node id
    return value if isinstance(value, int) else None


def _name(eds: DataSheet) -> str:
    info = eds.od.device_information
    vendor, product = info.vendor_name or "", info.product_name or ""
    words = product if product.startswith(vendor) else f"{vendor} {product}"
    return " ".join(_printable(words).split()) or eds.path.stem


def _identity(made: Proposal, eds: DataSheet) -> None:
    info = eds.od.device_information
    for sub, key, name, declared in (
        (1, "vendor_id", "VendorNumber", info.vendor_number),
        (2, "product_code", "ProductNumber", info.product_number),
        (3, "revision", "RevisionNumber", info.revision_number),
    ):
        in_identity = _number(eds, 0x1018, sub)
        if in_identity and declared and in_identity != declared:
            problem = (
                f"value {declared:#x}, but 1018h:{sub} is {in_identity:#x}, which takes precedence"
            )
            eds.remarks.add(f"[DeviceInfo] {name}", problem)
        value = in_identity or declared or 0
        if not 0 <= value <= 0xFFFFFFFF:
            value = 0
        source = f"1018h:{sub} in the EDS" if in_identity else f"[DeviceInfo] {name} in the EDS"
        if value:
            made.set(key, value, _MANUAL, source)
        else:
            made.set(key, value, _ASSUMED, "the EDS does not contain it")
            made.find_out(key)
    if made.table["revision"]:
        made.find_out("firmware")


def _units(made: Proposal, eds: DataSheet) -> None:
    """Set the units that the drive states itself (60A9h) or that its manufacturer is known for."""
    for key, (value, status, how) in _MAKERS.get(made.table["vendor_id"], {}).items():
        made.set(key, value, status, how)
    unit = VELOCITY_UNITS.get(_number(eds, 0x60A9) or 0)
    if unit is None:
        made.find_out("other_units")
        return
    acceleration = "rpm_per_s" if unit == "rpm" else "counts_per_s2"
    made.set("velocity_unit", unit, _MANUAL, "60A9h in the EDS")
    made.set("acceleration_unit", acceleration, _ASSUMED, "to match the unit of velocities")


def _modes(made: Proposal, eds: DataSheet) -> None:
    mask = _number(eds, 0x6502) or 0
    modes = [int(mode) for mode in supported_modes(mask)] if mask > 0 else []
    source = (_MANUAL, "default of 6502h in the EDS")
    if not modes:
        modes = _modes_by_objects(eds)
        source = (_ASSUMED, "from the objects in the EDS")
        made.find_out("modes")
    torque = [mode for mode in (Mode.CYCLIC_TORQUE, Mode.PROFILE_TORQUE) if mode in modes]
    if not torque:
        raise ProfileError(
            eds.path,
            "[6502] DefaultValue",
            f"value {mask:#x} has only the modes {', '.join(map(str, modes))}; allowed: a "
            "drive with mode 4 (PT, bit 3) or 10 (CST, bit 9), because winches need torque "
            "control",
        )
    made.set("supported_modes", modes, *source)
    made.set("mode_torque", int(torque[0]), *source)
    if torque[0] == Mode.PROFILE_TORQUE:
        _torque_slope(made, eds)


def _torque_slope(made: Proposal, eds: DataSheet) -> None:
    """Set the torque ramp of mode PT: the steepest that the EDS allows, else an assumed one."""
    slope, rated_mNm = eds.get(0x6087), _number(eds, 0x6076)
    if slope is not None and slope.max and rated_mNm and slope.max < 0xFFFFFFFF:
        steepest = slope.max * 1e-3 * rated_mNm * 1e-3
        how = "upper limit of 6087h, with the default of 6076h in the EDS"
        made.set("torque_slope_Nm_s", round(steepest, 3), _MANUAL, how)
    else:
        how = "steep enough to have no effect"
        made.set("torque_slope_Nm_s", _DEFAULT_SLOPE_Nm_s, _ASSUMED, how)
    made.find_out("slope")


def _modes_by_objects(eds: DataSheet) -> list[int]:
    there = eds.od.indices
    signs = ((1, 0x607A), (3, 0x60FF), (4, 0x6087), (6, _IN_PLACE), (10, 0x6071))
    found = [mode for mode, index in signs if index in there]
    if 0x60C2 in there or 0x60B2 in there:
        return found
    return [mode for mode in found if mode != 10] + [4] * (4 not in found)


def _homing(made: Proposal, eds: DataSheet) -> None:
    values = {_number(eds, 0x60E3, entry.subindex) for entry in eds.subs(0x60E3)}
    methods = sorted(value for value in values if value and -128 <= value <= 127)
    if methods:
        made.set("homing_methods", methods, _MANUAL, "60E3h in the EDS")
    elif _IN_PLACE in eds.od.indices:
        made.set(
            "homing_methods", [33, 34], _ASSUMED, "those of the standard that end at the index"
        )
        made.find_out("homing")
    else:
        made.set("homing_methods", [], _MANUAL, "6098h is not in the EDS")


def _pdos(made: Proposal, eds: DataSheet) -> None:
    rpdos, tpdos = _choose_rpdos(eds), _choose_tpdos(eds)
    for key, choice in (("rpdos", rpdos), ("tpdos", tpdos)):
        status = _MANUAL if choice.how.startswith("default map") else _ASSUMED
        made.set(key, choice.pdos, status, choice.how)
        if status == _ASSUMED:
            what, why = f"{key}: {choice.how}", "a drive may reject a map that its EDS allows"
            how = "the boot writes it and names the rejected object (step J)"
            made.unknown.append(Unknown(what, why, how))
    if _MODE_SHOWN not in tpdos.indexes:
        made.find_out("mode_display")
    if not {_PROBE_STATUS, _PROBE_POSITION} <= tpdos.indexes:
        made.find_out("touch_probe")


# PDO maps for torque control from an EDS: its default maps if suitable, else our own.

_Entry = tuple[int, int, int]
"""Index, sub-index and bits."""


@dataclass(frozen=True)
class _Offer:
    """One PDO of a drive; `entries` is its default map."""

    number: int
    cob_id_offset: int
    entries: tuple[_Entry, ...]
    room: int
    """Number of objects that can be mapped, 0 if the map is fixed."""
    type_writable: bool
    transmission_type: int

    def holds(self, indexes: Sequence[int]) -> bool:
        """Return whether the default map contains all of these objects."""
        return set(indexes) <= {index for index, _, _ in self.entries}

    def serves(self, transmission_type: int) -> bool:
        """Return whether the PDO can have this transmission type."""
        return self.type_writable or self.transmission_type == transmission_type

    def table(self, entries: Sequence[_Entry], transmission_type: int) -> dict[str, Any]:
        """Return the PDO in the form of a drive profile."""
        return {
            "number": self.number,
            "cob_id_offset": self.cob_id_offset,
            "transmission_type": transmission_type,
            "entries": [
                {"index": index, **({"subindex": sub} if sub else {}), "bits": bits}
                for index, sub, bits in entries
            ],
        }


@dataclass(frozen=True)
class _Choice:
    """The PDOs of one direction, in the form of a profile, and how they were chosen."""

    pdos: list[dict[str, Any]]
    how: str

    @property
    def indexes(self) -> set[int]:
        """The objects in these PDOs."""
        return {entry["index"] for pdo in self.pdos for entry in pdo["entries"]}


def _choose_rpdos(eds: DataSheet) -> _Choice:
    """Return RPDOs with controlword and target torque; raises ProfileError if impossible."""
    offers = _offers(eds, 0x1400, 0x200)
    harmless = [o for o in offers if all(index in _HARMLESS for index, _, _ in o.entries)]
    return _choose(eds, offers, harmless, _COMMAND, "RPDO")


def _choose_tpdos(eds: DataSheet) -> _Choice:
    """Return TPDOs with statusword, position and torque, and if possible mode and touch probe.

    Raises ProfileError if the first three are not possible.
    """
    offers = _offers(eds, 0x1800, 0x180)
    choice = _choose(eds, offers, offers, _FEEDBACK, "TPDO")
    taken = {pdo["number"] for pdo in choice.pdos}
    extra = [index for index in _EXTRA if index not in choice.indexes and _mappable(eds, index)]
    if not {_PROBE_STATUS, _PROBE_POSITION} <= set(extra):
        extra = [index for index in extra if index == _MODE_SHOWN]
    for offer in offers:
        if not extra or offer.number in taken or not offer.serves(_SYNC_WHEN_CHANGED):
            continue
        if offer.holds(extra):
            entries = list(offer.entries)
        elif offer.room:
            entries = _whole(eds, extra[: offer.room])
        else:
            continue
        return _Choice([*choice.pdos, offer.table(entries, _SYNC_WHEN_CHANGED)], choice.how)
    return choice


def _choose(
    eds: DataSheet,
    offers: list[_Offer],
    as_they_are: list[_Offer],
    objects: tuple[int, ...],
    kind: str,
) -> _Choice:
    """Use one PDO with its default map, else remap one PDO, else spread objects over several."""
    usable = [offer for offer in offers if offer.serves(_EVERY_SYNC)]
    for offer in usable:
        if offer in as_they_are and offer.holds(objects):
            return _Choice([offer.table(offer.entries, _EVERY_SYNC)], "default map in the EDS")
    blocked = [index for index in objects if not _mappable(eds, index)]
    for offer in usable:
        whole = _whole(eds, objects[: offer.room]) if not blocked else []
        if len(whole) == len(objects):
            how = "a map chosen here; according to the EDS it can be written"
            return _Choice([offer.table(whole, _EVERY_SYNC)], how)
    missing, chosen = list(objects), []
    for offer in usable:
        if offer in as_they_are and any(offer.holds([index]) for index in missing):
            entries = list(offer.entries)
        else:
            free = [index for index in missing if index not in blocked]
            entries = _whole(eds, free[: offer.room])
        if entries:
            chosen.append(offer.table(entries, _EVERY_SYNC))
            missing = [index for index in missing if index not in {e[0] for e in entries}]
        if not missing:
            return _Choice(chosen, "in several PDOs, because no PDO has room for all")
    raise ProfileError(eds.path, kind, _reason(offers, usable, blocked, objects, kind))


def _reason(
    offers: list[_Offer],
    usable: list[_Offer],
    blocked: list[int],
    objects: tuple[int, ...],
    kind: str,
) -> str:
    names = ", ".join(f"{index:04X}h" for index in objects)
    problem = f"no {kind} can carry {names}, which torque control needs: "
    if not offers:
        return problem + f"the file describes no {kind}"
    reasons = []
    if not usable:
        first = 0x1400 if kind == "RPDO" else 0x1800
        places = ", ".join(f"[{first + one.number - 1:04X}sub2]" for one in offers[:_MOST_NAMED])
        value = offers[0].transmission_type
        reasons.append(
            f"{places} AccessType does not allow writing transmission type 1 (every SYNC) in place "
            f"of {value}"
        )
    if blocked:
        names = ", ".join(f"[{index:04X}] PDOMapping" for index in blocked)
        reasons.append(f"{names} is not 1, and no default map contains it")
    if reasons:
        return problem + "; ".join(reasons)
    return problem + "the maps are fixed, or have too few entries that can be written"


def _offers(eds: DataSheet, first: int, predefined: int) -> list[_Offer]:
    offers = (_offer(eds, first, number, predefined) for number in range(1, _MOST_PDOS + 1))
    return [offer for offer in offers if offer is not None]


def _offer(eds: DataSheet, first: int, number: int, predefined: int) -> _Offer | None:
    """Return a PDO of the file, or None if it is missing or has no usable identifier."""
    index, mapping = first + number - 1, first + number + 0x1FF
    kind, count, places = eds.get(index, 2), eds.get(mapping), eds.subs(mapping)
    if eds.get(index, 1) is None or kind is None or not places:
        return None
    offset = (_number(eds, index, 1) or 0) & _IDENTIFIER
    if offset & _NODE or not 0x180 <= offset <= 0x57F:
        offset = predefined + (number - 1) * 0x100 if number <= _PREDEFINED else 0
    if not offset:
        return None
    free = count is not None and count.writable
    room = min(sum(place.writable for place in places), _MOST_ENTRIES) if free else 0
    transmission = _number(eds, index, 2) or 0
    return _Offer(number, offset, _entries(eds, mapping), room, kind.writable, transmission)


def _entries(eds: DataSheet, mapping: int) -> tuple[_Entry, ...]:
    """Return a default map, empty if it is invalid or does not fit a frame."""
    count = _number(eds, mapping) or 0
    entries = []
    for sub in range(1, min(count, _MOST_ENTRIES) + 1):
        value = _number(eds, mapping, sub) or 0
        if not value:  # CompactSubObj counts all places of a map
            break
        index, of, bits = value >> 16, value >> 8 & 0xFF, value & 0xFF
        mapped = eds.get(index, of)
        if mapped is None or bits_of(mapped) != bits or bits not in (8, 16, 32):
            problem = (
                f"maps {index:04X}h:{of} with {bits} bits, but the file describes the object "
                "differently"
            )
            eds.remarks.add(f"[{mapping:04X}sub{sub:X}]", problem)
            return ()
        entries.append((index, of, bits))
    if sum(bits for *_, bits in entries) > _FRAME_BITS:
        eds.remarks.add(f"[{mapping:04X}]", "maps more than the 64 bits of a frame")
        return ()
    return tuple(entries)


def _mappable(eds: DataSheet, index: int) -> bool:
    entry = eds.get(index)
    return entry is not None and entry.pdo_mappable and bits_of(entry) in _BITS[index]


def _whole(eds: DataSheet, indexes: Sequence[int]) -> list[_Entry]:
    """Return entries of whole objects, without those that do not fit the frame."""
    found: list[_Entry] = []
    for index in indexes:
        entry = eds.get(index)
        bits = _FRAME_BITS + 1 if entry is None else bits_of(entry)
        if sum(one[2] for one in found) + bits <= _FRAME_BITS:
            found.append((index, 0, bits))
    return found


# The profile as TOML.

_ENTRY_NAMES = {
    0x6040: "controlword",
    0x6071: "target torque",
    0x6041: "statusword",
    0x6064: "position actual value",
    0x6077: "torque actual value",
    0x6061: "mode display",
    0x60B9: "touch probe status",
    0x60BA: "touch probe 1, positive edge",
}
_HEXADECIMAL = ("vendor_id", "product_code", "revision", "cob_id_offset", "index")


def profile_text(made: Proposal, eds_name: str, source: str) -> str:
    """Return the profile as TOML with comments."""
    table = made.table
    lines = [
        f"# Made from {_printable(source)} by `cdpr drive import`: see [verified] for "
        "assumed values,",
        "# and docs/how-to/describing-your-drive.md for how to check them.",
        f"name = {_toml(table['name'])}",
        f"eds = {_toml(eds_name)}",
        "",
    ]
    for key, value in table.items():
        if key not in ("name", "rpdos", "tpdos"):
            lines.append(f"{key} = {_toml(value, key)}")
    for key in ("rpdos", "tpdos"):
        for pdo in table[key]:
            lines += ["", f"[[{key}]]", *_pdo_lines(pdo)]
    lines += ["", '# "verified" on the drive, from its "manual" (the EDS is one), or "assumed".']
    lines.append("[verified]")
    for key, (status, how) in made.verified.items():
        lines.append(f"{key} = {{ status = {_toml(status)}, how = {_toml(how)} }}")
    return "\n".join(lines) + "\n"


def _pdo_lines(pdo: dict[str, Any]) -> list[str]:
    keys = [f"{key} = {_toml(value, key)}" for key, value in pdo.items() if key != "entries"]
    entries = []
    for entry in pdo["entries"]:
        inner = ", ".join(f"{key} = {_toml(value, key)}" for key, value in entry.items())
        name = _ENTRY_NAMES.get(entry["index"])
        entries.append(f"  {{ {inner} }}," + (f"  # {name}" if name else ""))
    return [*keys, "entries = [", *entries, "]"]


def _toml(value: Any, key: str = "") -> str:
    if isinstance(value, str):
        return json.dumps(_printable(value), ensure_ascii=False)
    if isinstance(value, list):
        return "[" + ", ".join(_toml(one) for one in value) + "]"
    if isinstance(value, int) and key in _HEXADECIMAL:
        return f"0x{value:X}" if value < 1 << 16 else f"0x{value:08X}"
    return repr(value)


def _printable(text: str) -> str:
    """Return text that is valid in TOML, without characters that cannot be printed."""
    return "".join(c for c in text if c.isprintable())
