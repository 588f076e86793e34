"""What a profile says of a drive, as far as its EDS tells it, and what has to be found out."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

from cdpr_drivers.cia402 import Mode, supported_modes
from cdpr_profiles.eds.eds_check import EdsFile, require
from cdpr_profiles.errors import ProfileError
from cdpr_tools.drive_import.pdo_maps import BITS, choose_rpdos, choose_tpdos

_MANUAL, _ASSUMED = "manual", "assumed"
_USUAL_HOMING = (33, 34)
_IN_PLACE = 0x6098
_DEFAULT_SLOPE_Nm_s = 3000.0
_LOOK = "`cdpr drive od WINCH {what} --bus URL` reads it"


@dataclass(frozen=True)
class Unknown:
    """A fact that no EDS holds, what hangs on it, and how it is found out."""

    what: str
    why: str
    how: str


@dataclass
class Proposal:
    """A drive profile in the making: its keys, what is known of them, what is not."""

    table: dict[str, Any]
    verified: dict[str, tuple[str, str]] = field(default_factory=dict)
    """Status and source of each key."""
    unknown: list[Unknown] = field(default_factory=list)

    def set(self, key: str, value: Any, status: str, how: str) -> None:
        """Set a key, with where its value comes from."""
        self.table[key] = value
        self.verified[key] = status, how

    def find_out(self, what: str, why: str, how: str) -> None:
        """Add a fact that has to be found out; see `Unknown`."""
        self.unknown.append(Unknown(what, why, how))


def propose(eds: EdsFile) -> Proposal:
    """Return the profile of the drive that an EDS describes.

    Raises ProfileError for a drive that cannot be run in a torque mode over its PDOs.
    """
    for index, bits in BITS.items():
        if index in (0x6061, 0x60B9, 0x60BA):
            continue
        entry = require(eds, index, "torque control needs it")
        if entry.bits != bits:
            raise ProfileError(
                eds.path,
                f"[{index:04X}] DataType",
                f"value 0x{entry.data_type:04X} has {entry.bits} bits; allowed: one of {bits} bits",
            )
    for index in (0x6060, 0x6061):
        require(eds, index, "without it no mode of operation can be chosen and confirmed")
    made = Proposal({"name": _name(eds)})
    _identity(made, eds)
    _modes(made, eds)
    _homing(made, eds)
    _units_and_signs(made, eds)
    _times(made)
    _pdos(made, eds)
    for index, why in _CONSEQUENCES.items():
        if not eds.has(index):
            made.find_out(f"{index:04X}h is not in the EDS", why, "ask the maker, or a newer EDS")
    return made


def _name(eds: EdsFile) -> str:
    vendor, product = eds.info.get("vendorname", ""), eds.info.get("productname", "")
    words = product if product.startswith(vendor) else f"{vendor} {product}"
    text = "".join(c for c in words if c.isprintable())
    return " ".join(text.split()) or eds.path.stem


def _identity(made: Proposal, eds: EdsFile) -> None:
    for sub, key, info in (
        (1, "vendor_id", "VendorNumber"),
        (2, "product_code", "ProductNumber"),
        (3, "revision", "RevisionNumber"),
    ):
        in_identity, declared = eds.number(0x1018, sub), eds.info_number(info)
        if in_identity and declared and in_identity != declared:
            eds.remarks.add(
                f"[DeviceInfo] {info}",
                f"value {declared:#x}, but 1018h:{sub} is {in_identity:#x}, which counts",
            )
        value = in_identity or declared or 0
        if not 0 <= value <= 0xFFFFFFFF:
            value = 0
        source = f"1018h:{sub} in the EDS" if in_identity else f"[DeviceInfo] {info} in the EDS"
        made.set(
            key, value, *((_MANUAL, source) if value else (_ASSUMED, "the EDS does not give it"))
        )
        if not value:
            made.find_out(
                f"{key} (1018h:{sub})",
                "the boot refuses a drive whose identity differs",
                "`cdpr bus scan --bus URL` shows it; write it into the profile",
            )
    if made.table["revision"]:
        made.find_out(
            "revision of your drive",
            "makers ship newer firmware than the EDS is for, which the boot refuses (step N)",
            "`cdpr bus scan --bus URL`; ask the maker whether the EDS fits that firmware",
        )


def _modes(made: Proposal, eds: EdsFile) -> None:
    mask = eds.number(0x6502) or 0
    modes = [int(mode) for mode in supported_modes(mask)] if mask > 0 else []
    listed = bool(modes)
    if not listed:
        modes = _modes_by_objects(eds)
        made.find_out(
            "modes of operation",
            "the EDS has no value of 6502h; they are guessed from the objects that are there",
            _LOOK.format(what="6502") + ", bit 3 is PT, bit 9 CST",
        )
    source = (
        (_MANUAL, "default of 6502h in the EDS")
        if listed
        else (_ASSUMED, "from the objects in the EDS")
    )
    torque = [mode for mode in (Mode.CYCLIC_TORQUE, Mode.PROFILE_TORQUE) if mode in modes]
    if not torque:
        raise ProfileError(
            eds.path,
            "[6502] DefaultValue",
            f"value {mask:#x} has the modes {', '.join(map(str, modes))} only; allowed: one with 4 "
            "(PT, bit 3) or 10 (CST, bit 9), since winches are driven by torque",
        )
    made.set("supported_modes", modes, *source)
    made.set("mode_torque", int(torque[0]), *source)
    if torque[0] == Mode.PROFILE_TORQUE:
        _torque_slope(made, eds)


def _torque_slope(made: Proposal, eds: EdsFile) -> None:
    """PT follows a ramp: as steep as the drive takes it, where the EDS tells."""
    slope, rated_mNm = eds.get(0x6087), eds.number(0x6076)
    if slope is not None and slope.high and rated_mNm and slope.high < 0xFFFFFFFF:
        steepest = slope.high * 1e-3 * rated_mNm * 1e-3
        how = "upper limit of 6087h by the default of 6076h in the EDS"
        made.set("torque_slope_Nm_s", round(steepest, 3), _MANUAL, how)
    else:
        how = "steep enough not to be felt"
        made.set("torque_slope_Nm_s", _DEFAULT_SLOPE_Nm_s, _ASSUMED, how)
    made.find_out(
        "torque_slope_Nm_s (6087h)",
        "in PT the torque follows a ramp, which is a lag in the loop",
        "the steepest that 6087h takes: manual, or upper limit in the EDS",
    )


def _modes_by_objects(eds: EdsFile) -> list[int]:
    cyclic = eds.has(0x60C2) or eds.has(0x60B2)
    signs = ((1, 0x607A), (3, 0x60FF), (4, 0x6087), (6, _IN_PLACE), (10, 0x6071))
    found = [mode for mode, index in signs if eds.has(index)]
    return found if cyclic else [mode for mode in found if mode != 10] + [4] * (4 not in found)


def _homing(made: Proposal, eds: EdsFile) -> None:
    methods = sorted(
        {
            value
            for entry in eds.subs(0x60E3)
            if (value := eds.number(0x60E3, entry.sub)) and -128 <= value <= 127
        }
    )
    if methods:
        made.set("homing_methods", methods, _MANUAL, "60E3h in the EDS")
    elif eds.has(_IN_PLACE):
        made.set("homing_methods", list(_USUAL_HOMING), _ASSUMED, "the standard's, to the index")
        made.find_out(
            "homing methods",
            "the EDS has no list of them (60E3h)",
            "manual; `cdpr drive home WINCH --method 34 --bus URL` shows whether it takes one",
        )
    else:
        made.set("homing_methods", [], _MANUAL, "6098h is not in the EDS")


def _units_and_signs(made: Proposal, eds: EdsFile) -> None:
    made.set("torque_unit", "per_mille_of_rated", _ASSUMED, "as CiA 402-2 has it for 6071h")
    made.set("velocity_unit", "counts_per_s", _ASSUMED, "as CiA 402-2 has it without scaling")
    made.set("acceleration_unit", "counts_per_s2", _ASSUMED, "as CiA 402-2 has it without scaling")
    for key in ("position_sign", "torque_sign", "homing_sign"):
        made.set(key, 1, _ASSUMED, "no EDS tells it")
    made.find_out(
        "torque_unit (6071h, 6077h)",
        "a wrong one makes every torque wrong by a factor",
        "manual (a drive without 6076h rather counts in mNm); 6077h beside the current of "
        "6078h while the motor is held",
    )
    made.find_out(
        "velocity_unit, acceleration_unit (6099h, 609Ah)",
        "a wrong one makes homing run too fast or too slow",
        "manual; watch 606Ch while the shaft is turned by hand",
    )
    made.find_out(
        "position_sign",
        "the controller must know which way 6064h counts",
        "turn the shaft by hand the way that is to be positive; "
        + _LOOK.format(what="6064")
        + ", it must grow",
    )
    made.find_out(
        "torque_sign",
        "with a wrong one the first motion runs away, and is stopped",
        "`cdpr drive jog WINCH --bus URL` on a free shaft: it ends at once when wrong",
    )
    made.find_out(
        "homing_sign",
        "method 34 must turn the way position grows",
        "`cdpr drive home WINCH --method 34 --bus URL` on a free shaft",
    )
    made.find_out(
        "quirks: halt before a change of mode, homing without bit 10",
        "drives differ from the standard there",
        "manual; a mode that is never confirmed is told by the command",
    )
    if not eds.number(0x6076):
        made.find_out(
            "rated torque (6076h)",
            "torques are per mille of it, and the boot compares it with the motor's",
            _LOOK.format(what="6076") + "; in mNm, set by the drive's own setup program",
        )


def _times(made: Proposal) -> None:
    made.set("mode_display_timeout_s", 0.5, _ASSUMED, "generous")
    made.set("state_timeout_s", 1.0, _ASSUMED, "generous")
    made.set("feedback_delay_s", 0.0005, _ASSUMED, "usual for a drive which samples at 2 kHz")
    made.set("torque_delay_s", 0.00032, _ASSUMED, "first-order lag of a 500 Hz current loop")
    made.set("heartbeat_producer_s", 0.1, _ASSUMED, "our choice, written to 1017h")
    made.set("heartbeat_consumer_s", 0.5, _ASSUMED, "our choice, written to 1016h")
    made.find_out(
        "feedback_delay_s, torque_delay_s",
        "the compensation looks ahead by them",
        "manual: cycle of the position and current loop; the commissioning's report shows a "
        "residue that grows with speed when they are wrong",
    )
    made.find_out(
        "state_timeout_s, mode_display_timeout_s",
        "drives with a brake or a slow power stage need longer",
        "manual; `cdpr drive enable WINCH --bus URL` tells which state was not reached",
    )


def _pdos(made: Proposal, eds: EdsFile) -> None:
    rpdos, tpdos = choose_rpdos(eds), choose_tpdos(eds)
    for key, choice in (("rpdos", rpdos), ("tpdos", tpdos)):
        status = _MANUAL if choice.how.startswith("map by default") else _ASSUMED
        made.set(key, choice.pdos, status, choice.how)
        if status == _ASSUMED:
            made.find_out(
                f"{key}: {choice.how}",
                "a drive may refuse a map that its EDS allows",
                "the boot writes it and says which object was refused (step J)",
            )
    if 0x6061 not in tpdos.indexes:
        made.find_out(
            "mode display in a PDO",
            "6061h is in no map, so the mode is asked for by SDO",
            "nothing to do; a TPDO with 6061h is quicker",
        )
    if not {0x60B9, 0x60BA} <= tpdos.indexes:
        made.find_out(
            "touch probe (60B8h, 60B9h, 60BAh)",
            "not in the maps: the index can be found by homing only",
            "manual: zero pulse as a source of the touch probe",
        )


_CONSEQUENCES = {
    0x1006: "the drive does not know the cycle's period",
    0x1008: "the boot cannot show the device's name",
    0x1016: "the drive does not notice a master that falls silent: find out what stops it then",
    0x1017: "the drive sends no heartbeat: the master cannot supervise it (step K)",
    0x6007: "what the drive does when its master is lost is not set: manual",
    0x603F: "faults are told without their code",
    0x605A: "how the drive stops is not set: manual",
    0x6072: "the drive does not limit the torque as the master does",
    0x6076: "the motor's rated torque is taken from its profile",
    0x608F: "the encoder's resolution is taken from the winch's file",
}
