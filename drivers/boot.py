"""Boot of drives as CiA 302-2 lays it down: identity, configuration where it differs, start."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace

from drivers import sdo_abort
from drivers.bus_census import flood_text
from drivers.cia402 import State, mode_bits, state_of
from drivers.configuration import BootSettings, wanted_configuration
from drivers.download import configure, store
from drivers.errors import BootError, DriverError, SdoAbortError, SdoCancelledError, SdoError
from drivers.network import CanNetwork
from profiles import DriveProfile

__all__ = ["BootReport", "BootReports", "BootSettings", "boot", "boot_all"]

_DEVICE_TYPE, _IDENTITY = 0x1000, 0x1018
_PROFILE_402 = 402
_BOOT_UP_TIMEOUT_S = 2.0
_QUIET_DRIVE_S = 1.0
_LISTEN_SHARE, _LISTEN_LEAST_S = 0.6, 0.25
"""Of what drives tolerate of a silent master: one of our kind is heard several times in it."""
_MAY_BE_A_FLOOD = "BK"


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
    vouched: bool = False
    """Whether 1020h vouched for the configuration, so that it was not compared one by one."""
    stored: bool = False
    """Whether the drive was told to store its configuration (1010h)."""


class BootReports(dict[int, BootReport]):
    """Reports of the drives that are up, by node id."""

    def __init__(self, reports: Mapping[int, BootReport], missing: Mapping[int, BootError]) -> None:
        super().__init__(reports)
        self.missing = dict(missing)
        """Why each optional node that is not up did not boot, by node id."""


def boot(
    network: CanNetwork,
    node_id: int,
    profile: DriveProfile,
    want: BootSettings,
    *,
    store_configuration: bool = False,
) -> BootReport:
    """Boot one drive that `network` knows; see `boot_all`. Raises BootError, BusError."""
    drives = {node_id: (profile, replace(want, mandatory=True))}
    return boot_all(network, drives, store_configuration=store_configuration)[node_id]


def boot_all(
    network: CanNetwork,
    drives: Mapping[int, tuple[DriveProfile, BootSettings]],
    *,
    store_configuration: bool = False,
) -> BootReports:
    """Boot several drives at the same time, by node id.

    All listen together for another master. Then each drive's communication is reset, its identity
    held against the profile, what differs of its configuration written, and its heartbeat
    awaited. They are started together once no mandatory one has failed; a node that is not
    mandatory and fails stays in pre-operational and stands in `missing`. With
    `store_configuration` a drive whose stored configuration is another one is told to keep it
    (1010h).

    Raises the BootError of the lowest node id that failed, with the others' as notes (and who
    floods the bus, should that be why), once all have come to an end, and BusError.
    """
    _listen(network, drives)
    network.clear_alarm()
    reports: dict[int, BootReport] = {}
    errors: dict[int, BootError] = {}

    def prepare(
        node_id: int, profile: DriveProfile, want: BootSettings
    ) -> Callable[[], BootReport]:
        return lambda: _prepare(network, node_id, profile, want, store_configuration)

    nodes = sorted(drives)
    tasks = network.clock.together([prepare(node_id, *drives[node_id]) for node_id in nodes])
    for node_id, task in zip(nodes, tasks, strict=True):
        try:
            reports[node_id] = task.result()
        except BootError as error:
            errors[node_id] = error
    fatal = [error for node, error in errors.items() if drives[node][1].mandatory]
    if fatal:
        babbled = any(error.letter in _MAY_BE_A_FLOOD for error in fatal)
        flood = flood_text(network.url, network.clock) if babbled else ""
        for other in (*fatal[1:], flood):
            if other:
                fatal[0].add_note(str(other))
        raise fatal[0]
    for node_id in reports:
        network.start(node_id, drives[node_id][0].heartbeat_producer_s)
    return BootReports(reports, errors)


def _listen(network: CanNetwork, drives: Mapping[int, tuple[DriveProfile, BootSettings]]) -> None:
    waits_s = max(profile.heartbeat_consumer_s for profile, _ in drives.values())
    what = network.hear_master(max(_LISTEN_LEAST_S, _LISTEN_SHARE * waits_s))
    if what:
        raise BootError(
            "L", min(drives), f"another master's {what} is on the bus", "stop that master first"
        )


def _prepare(
    network: CanNetwork,
    node_id: int,
    profile: DriveProfile,
    want: BootSettings,
    store_configuration: bool,
) -> BootReport:
    """Lead one drive as far as it goes without being started."""
    try:
        return _lead(network, node_id, profile, want, store_configuration)
    except BootError:
        _refuse_twins(network, node_id)  # what explains the rest comes first
        raise


def _lead(
    network: CanNetwork,
    node_id: int,
    profile: DriveProfile,
    want: BootSettings,
    store_configuration: bool,
) -> BootReport:
    report = BootReport(node_id)
    _refuse_a_driven_node(network, node_id)
    network.reset_communication(node_id, _BOOT_UP_TIMEOUT_S)  # one that is silent may yet answer
    _check_identity(network, node_id, profile, report)
    _configure(network, node_id, profile, want, report)
    patience_s = 5.0 * profile.heartbeat_producer_s + _QUIET_DRIVE_S
    if network.wait_for_heartbeat(node_id, patience_s) is None:
        raise BootError("K", node_id, "no heartbeat came", "check 1017h and the load of the bus")
    _read_ratings(network, node_id, profile, want, report)
    if store_configuration and (report.changed or not report.vouched):
        report.stored = _store(network, node_id)
    _refuse_twins(network, node_id)
    return report


def _read(network: CanNetwork, node_id: int, index: int, sub: int) -> int | None:
    """Return what an object of the identity holds, None where the drive has none."""
    try:
        return network.read_int(node_id, index, sub)
    except SdoAbortError as error:
        if error.code in sdo_abort.ABSENT:
            return None
        raise BootError(
            "B",
            node_id,
            f"it refuses to say what it is ({error})",
            "switch it off and on; if that does not help, check that it is the drive meant",
        ) from error
    except SdoError as error:
        raise BootError(
            "B",
            node_id,
            f"it does not answer ({error})",
            "check power, wiring, termination, bit rate and the node id set on the drive",
        ) from error


def _refuse_a_driven_node(network: CanNetwork, node_id: int) -> None:
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


def _refuse_twins(network: CanNetwork, node_id: int) -> None:
    """Raise BootError where two devices answer under one node id."""
    problem = network.twins(node_id)
    if problem:
        raise BootError(
            "B",
            node_id,
            problem,
            "give each device a node id of its own (connect one alone to see which it is)",
        )


def _check_identity(
    network: CanNetwork, node_id: int, profile: DriveProfile, report: BootReport
) -> None:
    device = _read(network, node_id, _DEVICE_TYPE, 0)
    if device is None or device & 0xFFFF != _PROFILE_402:
        raise BootError(
            "C",
            node_id,
            f"its device type is {_hex(device)}, not a CiA 402 drive",
            "check the node id: this may be another device",
        )
    steps = (
        ("D", 1, "vendor id", "vendor_id", profile.vendor_id),
        ("M", 2, "product code", "product_code", profile.product_code),
        ("N", 3, "revision", "revision", profile.revision),
        ("O", 4, "serial number", "serial", profile.serial),
    )
    for letter, sub, what, name, wanted in steps:
        # of these only the vendor id is mandatory (CiA 301)
        found = (
            _read(network, node_id, _IDENTITY, sub) if _may_have(network, node_id, sub) else None
        )
        setattr(report, name, found or 0)
        if wanted is not None and found != wanted:
            raise BootError(
                letter,
                node_id,
                f"its {what} is {_hex(found)}, the profile {profile.name!r} has {wanted:08X}h",
                "choose the profile of this drive, or connect the drive that was meant",
            )


def _may_have(network: CanNetwork, node_id: int, sub: int) -> bool:
    """Return whether the EDS gives the identity such a sub-index."""
    return sub in network.dictionary(node_id).get(_IDENTITY, ())


def _hex(found: int | None) -> str:
    return "not there" if found is None else f"{found:08X}h"


def _configure(
    network: CanNetwork,
    node_id: int,
    profile: DriveProfile,
    want: BootSettings,
    report: BootReport,
) -> None:
    try:
        wanted = wanted_configuration(
            profile,
            network.dictionary(node_id),
            node_id,
            want,
            _rated_torque_Nm(network, node_id, want),
            _heartbeat_entry(network, node_id, want.master_node_id),
        )
        report.absent += wanted.absent
        report.vouched = configure(network, node_id, wanted, report.changed)
    except DriverError as error:
        if isinstance(error, SdoError) or type(error) is DriverError:
            raise BootError(
                "J", node_id, f"its configuration failed: {error}", "check the profile of the drive"
            ) from error
        raise


def _store(network: CanNetwork, node_id: int) -> bool:
    try:
        return store(network, node_id)
    except SdoError as error:
        raise BootError(
            "J",
            node_id,
            f"its configuration could not be stored: {error}",
            "boot without storing; it then is written anew each time",
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
    if 0x1016 not in network.dictionary(node_id):
        return 1
    entries = network.read_int(node_id, 0x1016, 0)
    watched = {
        sub: network.read_int(node_id, 0x1016, sub) >> 16 & 0x7F for sub in range(1, entries + 1)
    }
    for wanted in (master_node_id, 0):
        for sub, node in watched.items():
            if node == wanted:
                return sub
    return 1


def _device_name(network: CanNetwork, node_id: int) -> str:
    """Return 1008h, empty where the drive does not tell it: a name is nothing to fail for."""
    try:
        return str(network.read(node_id, 0x1008))
    except SdoCancelledError:
        raise
    except SdoError:
        return ""


def _read_ratings(
    network: CanNetwork,
    node_id: int,
    profile: DriveProfile,
    want: BootSettings,
    report: BootReport,
) -> None:
    try:
        report.device_name = _device_name(network, node_id)
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
