"""Boot of a drive as CiA 302-2 lays it down: identity, configuration where it differs, start."""

from __future__ import annotations

from dataclasses import dataclass, field

from canopen.objectdictionary import ODVariable

from drivers.cia402 import State, state_of
from drivers.errors import BootError, SdoError
from drivers.network import CanNetwork
from profiles import DriveProfile, Pdo

_DEVICE_TYPE, _IDENTITY = 0x1000, 0x1018
_PROFILE_402 = 402
_PDO_OFF = 1 << 31
_BOOT_UP_TIMEOUT_S = 2.0
_QUICK_STOP = 3
_SLOW_DOWN_THEN_OFF = 2


@dataclass(frozen=True)
class BootSettings:
    """What the master wants of a drive besides its profile."""

    master_node_id: int
    sync_period_s: float
    torque_limit_Nm: float


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


def boot(
    network: CanNetwork, node_id: int, profile: DriveProfile, want: BootSettings
) -> BootReport:
    """Boot one drive that `network` knows.

    The node's communication is reset, its identity held against the profile, the objects that
    differ are written, its heartbeat is awaited and it is started. Raises BootError with the
    standard's letter for the step that failed.
    """
    report = BootReport(node_id)
    _refuse_a_driven_node(network, node_id)
    if not network.reset_communication(node_id, _BOOT_UP_TIMEOUT_S):
        _read(network, node_id, _DEVICE_TYPE, 0)  # no boot-up message, yet it may answer
    network.clear_alarm()
    _check_identity(network, node_id, profile, report)
    _configure(network, node_id, profile, want, report)
    if network.wait_for_heartbeat(node_id, 5.0 * profile.heartbeat_producer_s + 1.0) is None:
        raise BootError("K", node_id, "no heartbeat came", "check 1017h and the load of the bus")
    network.start(node_id)
    _read_ratings(network, node_id, report)
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


def _refuse_a_driven_node(network: CanNetwork, node_id: int) -> None:
    if network.foreign_master.is_set():
        raise BootError(
            "L", node_id, "another master's heartbeat is on the bus", "stop that master first"
        )
    try:
        state = state_of(network.read_int(node_id, 0x6041))
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
        rated_Nm = network.read_int(node_id, 0x6076) * 1e-3
        limit = min(1000 * want.torque_limit_Nm / rated_Nm, 0xFFFF) if rated_Nm > 0.0 else 0
        watch = want.master_node_id << 16 | round(profile.heartbeat_consumer_s * 1e3)
        objects = (
            (0x1006, 0, round(want.sync_period_s * 1e6)),
            (0x1016, 1, watch),
            (0x1017, 0, round(profile.heartbeat_producer_s * 1e3)),
            (0x6007, 0, _QUICK_STOP),  # the master's heartbeat is lost
            (0x605A, 0, _SLOW_DOWN_THEN_OFF),
            (0x6072, 0, round(limit)),
        )
        for index, sub, value in objects:
            _set(network, node_id, index, sub, value, report)
        for pdos, parameters in ((profile.rpdos, 0x1400), (profile.tpdos, 0x1800)):
            for pdo in pdos:
                _set_pdo(network, node_id, parameters + pdo.number - 1, pdo, report)
    except SdoError as error:
        raise BootError(
            "J", node_id, f"its configuration failed: {error}", "check the profile of the drive"
        ) from error


def _set(
    network: CanNetwork, node_id: int, index: int, sub: int, value: int, report: BootReport
) -> None:
    if network.read_int(node_id, index, sub) != value:
        network.write(node_id, index, sub, value)
        report.changed.append(f"{index:04X}h:{sub} = {value}")


def _set_pdo(
    network: CanNetwork, node_id: int, parameters: int, pdo: Pdo, report: BootReport
) -> None:
    mapping = parameters + 0x200
    cob_id = pdo.cob_id(node_id)
    sub: dict[int, int] = {1: cob_id, 2: pdo.transmission_type}
    if parameters >= 0x1800:
        sub |= {3: round(pdo.inhibit_time_s * 1e4), 5: round(pdo.event_timer_s * 1e3)}
    elif pdo.event_timer_s:
        sub |= {5: round(pdo.event_timer_s * 1e3)}
    wanted = {(parameters, number): value for number, value in sub.items()}
    wanted[mapping, 0] = len(pdo.entries)
    wanted |= {(mapping, i): entry.mapping for i, entry in enumerate(pdo.entries, 1)}
    known = {key: value for key, value in wanted.items() if _exists(network, node_id, *key)}
    # the identifier's reserved bits differ between drives: only those of the standard count
    significant = _PDO_OFF | 0x3FFFFFFF
    found = {key: network.read_int(node_id, *key) for key in known}
    found[parameters, 1] &= significant
    if found == known:
        return
    # CiA 301: switched off first, the map emptied, filled and counted, then switched on
    network.write(node_id, parameters, 1, cob_id | _PDO_OFF)
    network.write(node_id, mapping, 0, 0)
    for (index, number), value in known.items():
        if number and (index, number) != (parameters, 1):
            network.write(node_id, index, number, value)
    network.write(node_id, mapping, 0, len(pdo.entries))
    network.write(node_id, parameters, 1, cob_id)
    report.changed.append(f"{parameters:04X}h and {mapping:04X}h")


def _exists(network: CanNetwork, node_id: int, index: int, sub: int) -> bool:
    """Return whether the EDS has the object; drives leave out what they do not support."""
    dictionary = network.dictionary(node_id)
    if index not in dictionary:
        raise SdoError(f"object {index:04X}h is not in the drive's EDS")
    entry = dictionary[index]
    return sub == 0 if isinstance(entry, ODVariable) else sub in entry


def _read_ratings(network: CanNetwork, node_id: int, report: BootReport) -> None:
    try:
        report.device_name = str(network.read(node_id, 0x1008))
        report.rated_torque_Nm = network.read_int(node_id, 0x6076) * 1e-3
        increments, turns = (network.read_int(node_id, 0x608F, sub) for sub in (1, 2))
        report.supported_modes = network.read_int(node_id, 0x6502)
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
