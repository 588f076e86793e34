"""Boot of a drive as CiA 302-2 lays it down: identity, configuration where it differs, start."""

from __future__ import annotations

from collections.abc import Mapping
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field

from canopen.objectdictionary import ODVariable

from drivers.cia402 import State, mode_bits, state_of
from drivers.drive_units import torque_settings
from drivers.errors import BootError, SdoError
from drivers.network import CanNetwork
from profiles import DriveProfile, Pdo

_DEVICE_TYPE, _IDENTITY = 0x1000, 0x1018
_PROFILE_402 = 402
_PDO_OFF, _NO_RTR, _IDENTIFIER = 1 << 31, 1 << 30, 0x1FFFFFFF
_BOOT_UP_TIMEOUT_S = 2.0
_QUICK_STOP = 3
_SLOW_DOWN_THEN_OFF = 2
_QUIET_DRIVE_S = 1.0


@dataclass(frozen=True)
class BootSettings:
    """What the master wants of a drive besides its profile."""

    master_node_id: int
    sync_period_s: float
    torque_limit_Nm: float
    rated_torque_Nm: float | None = None
    """What 6076h must hold, and what holds without it; None leaves it unchecked."""
    counts_per_turn: int | None = None
    """Encoder resolution of a drive that has no 608Fh."""


@dataclass
class BootReport:
    """What a drive said while it booted, and what had to be changed in it."""

    node_id: int
    device_name: str = ""
    vendor_id: int = 0
    product_code: int = 0
    revision: int = 0
    serial: int = 0
    rated_torque_Nm: float = 0.0
    counts_per_turn: int = 0
    supported_modes: int = 0
    changed: list[str] = field(default_factory=list)
    """Objects that were written since they differed, as "6072h:0 = 250"."""
    absent: list[str] = field(default_factory=list)
    """Objects the master would set, which the drive does not have."""


def boot_all(
    network: CanNetwork, drives: Mapping[int, tuple[DriveProfile, BootSettings]]
) -> dict[int, BootReport]:
    """Boot several drives at the same time, by node id.

    Raises the BootError of the lowest node id that failed, with the others' as notes, once all
    have come to an end.
    """
    with ThreadPoolExecutor(max_workers=len(drives)) as pool:
        pending = {
            node_id: pool.submit(boot, network, node_id, profile, want)
            for node_id, (profile, want) in sorted(drives.items())
        }
    errors = [error for job in pending.values() if (error := job.exception()) is not None]
    if errors:
        for other in errors[1:]:
            errors[0].add_note(str(other))
        raise errors[0]
    return {node_id: job.result() for node_id, job in pending.items()}


def boot(
    network: CanNetwork, node_id: int, profile: DriveProfile, want: BootSettings
) -> BootReport:
    """Boot one drive that `network` knows.

    The node's communication is reset, its identity held against the profile, the objects that
    differ are written, its heartbeat is awaited and it is started. Raises BootError with the
    standard's letter for the step that failed.
    """
    report = BootReport(node_id)
    # a master of our kind is heard four times within what its drives tolerate
    _refuse_a_driven_node(network, node_id, 0.5 * profile.heartbeat_consumer_s)
    network.reset_communication(node_id, _BOOT_UP_TIMEOUT_S)  # one that is silent may yet answer
    network.clear_alarm()
    _check_identity(network, node_id, profile, report)
    _configure(network, node_id, profile, want, report)
    patience_s = 5.0 * profile.heartbeat_producer_s + _QUIET_DRIVE_S
    if network.wait_for_heartbeat(node_id, patience_s) is None:
        raise BootError("K", node_id, "no heartbeat came", "check 1017h and the load of the bus")
    _read_ratings(network, node_id, profile, want, report)
    network.start(node_id)
    return report


def _read(network: CanNetwork, node_id: int, index: int, sub: int) -> int:
    try:
        return network.read_int(node_id, index, sub)
    except SdoError as error:
        raise BootError(
            "B",
            node_id,
            f"it does not answer ({error})",
            "check power, wiring, termination, bit rate and the node id set on the drive",
        ) from error


def _refuse_a_driven_node(network: CanNetwork, node_id: int, listen_s: float) -> None:
    if network.foreign_master.wait(listen_s):
        raise BootError(
            "L", node_id, "another master's heartbeat is on the bus", "stop that master first"
        )
    try:
        state = state_of(network.read_int(node_id, 0x6041, attempts=1))
    except SdoError:
        return  # whether it is there at all is for the next step to say
    if state == State.OPERATION_ENABLED:
        raise BootError(
            "L",
            node_id,
            "its power stage is already enabled, so somebody drives it",
            "stop the other master, or switch the drive off and on",
        )


def _check_identity(
    network: CanNetwork, node_id: int, profile: DriveProfile, report: BootReport
) -> None:
    device = _read(network, node_id, _DEVICE_TYPE, 0)
    if device & 0xFFFF != _PROFILE_402:
        raise BootError(
            "C",
            node_id,
            f"its device type is {device:08X}h, not a CiA 402 drive",
            "check the node id: this may be another device",
        )
    steps = (
        ("D", 1, "vendor id", "vendor_id", profile.vendor_id),
        ("M", 2, "product code", "product_code", profile.product_code),
        ("N", 3, "revision", "revision", profile.revision),
        ("O", 4, "serial number", "serial", profile.serial),
    )
    for letter, sub, what, name, wanted in steps:
        found = _read(network, node_id, _IDENTITY, sub)
        setattr(report, name, found)
        if wanted is not None and found != wanted:
            raise BootError(
                letter,
                node_id,
                f"its {what} is {found:08X}h, the profile {profile.name!r} has {wanted:08X}h",
                "choose the profile of this drive, or connect the drive that was meant",
            )


def _configure(
    network: CanNetwork,
    node_id: int,
    profile: DriveProfile,
    want: BootSettings,
    report: BootReport,
) -> None:
    try:
        rated_Nm = _rated_torque_Nm(network, node_id, want)
        watch = want.master_node_id << 16 | round(profile.heartbeat_consumer_s * 1e3)
        objects = (
            (0x1006, 0, round(want.sync_period_s * 1e6)),
            (0x1016, _heartbeat_entry(network, node_id, want.master_node_id), watch),
            (0x1017, 0, round(profile.heartbeat_producer_s * 1e3)),
            (0x6007, 0, _QUICK_STOP),  # when the master's heartbeat is lost
            (0x605A, 0, _SLOW_DOWN_THEN_OFF),
            *((i, 0, v) for i, v in torque_settings(profile, rated_Nm, want.torque_limit_Nm)),
            (0x60B2, 0, 0),  # a torque offset left behind would be added to every torque
        )
        for index, sub, value in objects:
            _set(network, node_id, index, sub, value, report)
        for pdos, parameters in ((profile.rpdos, 0x1400), (profile.tpdos, 0x1800)):
            ours = {parameters + pdo.number - 1: pdo for pdo in pdos}
            for index in range(parameters, parameters + 0x200):
                if index in ours:
                    _set_pdo(network, node_id, index, ours[index], report)
                elif index in network.dictionary(node_id):
                    _switch_off_pdo(network, node_id, index, report)
    except SdoError as error:
        raise BootError(
            "J", node_id, f"its configuration failed: {error}", "check the profile of the drive"
        ) from error


def _rated_torque_Nm(network: CanNetwork, node_id: int, want: BootSettings) -> float:
    """Return what the drive holds for the motor's rated torque, else what the master does."""
    if 0x6076 in network.dictionary(node_id):
        return network.read_int(node_id, 0x6076) * 1e-3
    return want.rated_torque_Nm or 0.0


def _counts_per_turn(network: CanNetwork, node_id: int, want: BootSettings) -> tuple[int, int]:
    """Return encoder increments and motor turns, as 608Fh has them."""
    if 0x608F in network.dictionary(node_id):
        return network.read_int(node_id, 0x608F, 1), network.read_int(node_id, 0x608F, 2)
    return want.counts_per_turn or 0, 1


def _heartbeat_entry(network: CanNetwork, node_id: int, master_node_id: int) -> int:
    """Return the entry of 1016h that watches the master already, else the first free one.

    CiA 301 refuses a second entry for one node.
    """
    entries = network.read_int(node_id, 0x1016, 0)
    watched = {
        sub: network.read_int(node_id, 0x1016, sub) >> 16 & 0x7F for sub in range(1, entries + 1)
    }
    for wanted in (master_node_id, 0):
        for sub, node in watched.items():
            if node == wanted:
                return sub
    return 1


def _set(
    network: CanNetwork, node_id: int, index: int, sub: int, value: int, report: BootReport
) -> None:
    if index not in network.dictionary(node_id):
        report.absent.append(f"{index:04X}h:{sub}")
    elif network.read_int(node_id, index, sub) != value:
        network.write(node_id, index, sub, value)
        report.changed.append(f"{index:04X}h:{sub} = {value}")


def _set_pdo(
    network: CanNetwork, node_id: int, parameters: int, pdo: Pdo, report: BootReport
) -> None:
    mapping = parameters + 0x200
    settings = {2: pdo.transmission_type}
    inhibit, timer = round(pdo.inhibit_time_s * 1e4), round(pdo.event_timer_s * 1e3)
    entry = network.dictionary(node_id)[parameters]
    for sub, value in ((3, inhibit), (5, timer)):
        if not isinstance(entry, ODVariable) and sub in entry:
            settings[sub] = value
    wanted = {(parameters, sub): value for sub, value in settings.items()}
    wanted |= {(mapping, i): entry.mapping for i, entry in enumerate(pdo.entries, 1)}
    cob_id = network.read_int(node_id, parameters, 1)
    as_it_is = network.read_int(node_id, mapping, 0) == len(pdo.entries) and all(
        network.read_int(node_id, *key) == value for key, value in wanted.items()
    )
    if as_it_is and cob_id & (_PDO_OFF | _IDENTIFIER) == pdo.cob_id(node_id):
        return
    # CiA 301: switched off first, the map emptied, filled and counted, then switched on; whether
    # it may be asked for by a remote frame is the drive's affair
    enabled = pdo.cob_id(node_id) | cob_id & _NO_RTR
    network.write(node_id, parameters, 1, enabled | _PDO_OFF)
    network.write(node_id, mapping, 0, 0)
    for (index, sub), value in wanted.items():
        network.write(node_id, index, sub, value)
    network.write(node_id, mapping, 0, len(pdo.entries))
    network.write(node_id, parameters, 1, enabled)
    report.changed.append(f"{parameters:04X}h and {mapping:04X}h")


def _switch_off_pdo(network: CanNetwork, node_id: int, parameters: int, report: BootReport) -> None:
    """Switch off a PDO that the profile does not have: the bus was not laid out for it."""
    cob_id = network.read_int(node_id, parameters, 1)
    if not cob_id & _PDO_OFF:
        network.write(node_id, parameters, 1, cob_id | _PDO_OFF)
        report.changed.append(f"{parameters:04X}h switched off")


def _read_ratings(
    network: CanNetwork,
    node_id: int,
    profile: DriveProfile,
    want: BootSettings,
    report: BootReport,
) -> None:
    try:
        report.device_name = str(network.read(node_id, 0x1008))
        report.rated_torque_Nm = _rated_torque_Nm(network, node_id, want)
        increments, turns = _counts_per_turn(network, node_id, want)
        if 0x6502 in network.dictionary(node_id):
            report.supported_modes = network.read_int(node_id, 0x6502)
        else:
            report.supported_modes = mode_bits(profile.supported_modes)
    except SdoError as error:
        raise BootError(
            "J", node_id, f"its ratings cannot be read: {error}", "check the drive's EDS"
        ) from error
    if report.rated_torque_Nm <= 0.0 or increments <= 0 or turns <= 0 or increments % turns:
        raise BootError(
            "J",
            node_id,
            f"rated torque {report.rated_torque_Nm} Nm (6076h) or encoder resolution "
            f"{increments}/{turns} (608Fh) make no sense",
            "set the drive's motor data first",
        )
    report.counts_per_turn = increments // turns
    rated = want.rated_torque_Nm
    if rated is not None and abs(report.rated_torque_Nm - rated) > 0.5e-3 + 1e-3 * rated:
        raise BootError(
            "J",
            node_id,
            f"its rated torque (6076h) is {report.rated_torque_Nm:g} Nm, the motor's profile has "
            f"{rated:g} Nm",
            "every torque would be off by this ratio: set the drive's motor data, or choose the "
            "motor that is mounted",
        )
