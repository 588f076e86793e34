"""Boot drives as CiA 302-2 specifies: identity, configuration if it differs, start."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import partial

from cdpr_drivers.bus import open_port
from cdpr_drivers.bus.budget import worst_case_bits
from cdpr_drivers.bus.frames import EFF_MASK, FRAME, FrameReader
from cdpr_drivers.bus.url import BusUrl
from cdpr_drivers.canopen.configuration import BootSettings, configure, make_configuration, store
from cdpr_drivers.canopen.network import CanNetwork
from cdpr_drivers.canopen.sdo import ABSENT
from cdpr_drivers.cia402 import State, mode_bits, state_of
from cdpr_drivers.drive_units import (
    VELOCITY_UNITS,
    CURRENTS_Arms,
    rated_torque_unit_Nm,
    suspected_unit,
)
from cdpr_drivers.errors import (
    BootError,
    BusError,
    DriverError,
    SdoAbortError,
    SdoCancelledError,
    SdoError,
)
from cdpr_profiles import DriveProfile
from cdpr_rt.core.clock import Clock

# Traffic on a bus by identifier, to name the node that floods it.

USUAL_BITRATE_bit_s = 1_000_000
_FLOOD_LOAD = 0.5
_LISTEN_S = 0.1
_POLL_S = 0.01
_MOST_FRAMES = 20_000


def flood_text(url: BusUrl, clock: Clock, bitrate_bit_s: int = USUAL_BITRATE_bit_s) -> str:
    """Return which identifier floods a bus if its load is above 50 %; else an empty text.

    The load assumes worst-case bit stuffing. The text explains another failure, so it is empty
    if the bus cannot be used.
    """
    frames: Counter[int] = Counter()
    bits: Counter[int] = Counter()
    try:
        reader = FrameReader(open_port(url))
    except BusError:
        return ""

    def take(last: int) -> None:
        for row in reader.frames.rows[:last]:
            identifier, length, _ = FRAME.unpack_from(row)
            frames[identifier & EFF_MASK] += 1
            bits[identifier & EFF_MASK] += worst_case_bits(length)

    reader.take = take
    begin_s = clock.now_s
    try:
        while clock.now_s < begin_s + _LISTEN_S and frames.total() < _MOST_FRAMES:
            clock.sleep(_POLL_S)
            while reader.poll() and frames.total() < _MOST_FRAMES:
                continue
    except BusError:
        return ""
    finally:
        reader.close()
    elapsed_s = max(clock.now_s - begin_s, 1e-6)
    load = bits.total() / elapsed_s / bitrate_bit_s
    if load < _FLOOD_LOAD:
        return ""
    identifier = bits.most_common(1)[0][0]
    # the predefined connection set (CiA 301) assigns these identifiers to nodes
    node = identifier & 0x7F if 0x080 < identifier < 0x780 else 0
    sender = f" (node {node} by the usual numbering)" if node else ""
    return (
        f"the bus is flooded: {load:.0%} load, most of it {frames[identifier] / elapsed_s:.0f} "
        f"frames/s with identifier {identifier:03X}h{sender}; switch that device off"
    )


__all__ = ["BootReport", "BootReports", "BootSettings", "boot", "boot_all"]

_DEVICE_TYPE, _IDENTITY = 0x1000, 0x1018
_PROFILE_402 = 402
_BOOT_UP_TIMEOUT_S = 2.0
_HEARTBEAT_MARGIN_S = 1.0
_LISTEN_SHARE, _LISTEN_LEAST_S = 0.6, 0.25
"""Time to listen for a master: share of the drives' heartbeat timeout, and least time."""
_STEPS_FAILED_BY_FLOOD = "BK"


@dataclass
class BootReport:
    """Identity and ratings of a drive that has booted, and the objects written to it."""

    node_id: int
    device_name: str = ""
    vendor_id: int = 0
    product_code: int = 0
    revision: int = 0
    serial: int = 0
    rated_torque_Nm: float = 0.0
    torque_constant_Nm_per_Arms: float = 0.0
    counts_per_turn: int = 0
    supported_modes: int = 0
    changed: list[str] = field(default_factory=list)
    """Objects that were written because they differed, as "6072h:0 = 250"."""
    absent: list[str] = field(default_factory=list)
    """Objects that the master would set but the drive does not have."""
    stamp_matched: bool = False
    """Whether 1020h held the configuration's stamp, so that objects were not compared."""
    stored: bool = False
    """Whether the drive was commanded to store its configuration (1010h)."""


class BootReports(dict[int, BootReport]):
    """Reports of the booted drives, by node id."""

    def __init__(self, reports: Mapping[int, BootReport], missing: Mapping[int, BootError]) -> None:
        super().__init__(reports)
        self.missing = dict(missing)
        """Why each missing optional node did not boot, by node id."""


def boot(
    network: CanNetwork,
    node_id: int,
    profile: DriveProfile,
    settings: BootSettings,
    *,
    store_configuration: bool = False,
) -> BootReport:
    """Boot one drive of `network`; see `boot_all`. Raises BootError, BusError."""
    drives = {node_id: (profile, replace(settings, mandatory=True))}
    return boot_all(network, drives, store_configuration=store_configuration)[node_id]


def boot_all(
    network: CanNetwork,
    drives: Mapping[int, tuple[DriveProfile, BootSettings]],
    *,
    store_configuration: bool = False,
    bitrate_bit_s: int = USUAL_BITRATE_bit_s,
) -> BootReports:
    """Boot several drives at the same time, by node id.

    The bus is first checked for another master. For each drive, boot resets the communication,
    compares the identity with the profile, writes the parts of the configuration that differ, and
    waits for the heartbeat. If no mandatory drive fails, all start together; a failed optional
    drive stays in pre-operational and is listed in `missing`. With `store_configuration`, a drive
    whose stored configuration differs is commanded to store this one (1010h). `bitrate_bit_s` is
    that of the bus; its load is computed from it.

    Waits for all, then raises the BootError of the lowest node id that failed. Notes list the other
    errors, and the node that floods the bus if that is the likely cause. Raises BusError.
    """
    _refuse_second_master(network, drives)
    network.clear_alarm()
    reports: dict[int, BootReport] = {}
    errors: dict[int, BootError] = {}

    nodes = sorted(drives)
    boots = [_NodeBoot(network, node_id, *drives[node_id]) for node_id in nodes]
    tasks = network.clock.gather([partial(boot.run, store_configuration) for boot in boots])
    for node_id, task in zip(nodes, tasks, strict=True):
        try:
            reports[node_id] = task.result()
        except BootError as error:
            errors[node_id] = error
    fatal = [error for node, error in errors.items() if drives[node][1].mandatory]
    if fatal:
        may_be_flood = any(error.letter in _STEPS_FAILED_BY_FLOOD for error in fatal)
        flood = flood_text(network.url, network.clock, bitrate_bit_s) if may_be_flood else ""
        for other in (*fatal[1:], flood):
            if other:
                fatal[0].add_note(str(other))
        raise fatal[0]
    for node_id in reports:
        network.start(node_id, drives[node_id][0].heartbeat_producer_s)
    return BootReports(reports, errors)


def _refuse_second_master(
    network: CanNetwork, drives: Mapping[int, tuple[DriveProfile, BootSettings]]
) -> None:
    waits_s = max(profile.heartbeat_consumer_s for profile, _ in drives.values())
    what = network.detect_master(max(_LISTEN_LEAST_S, _LISTEN_SHARE * waits_s))
    if what:
        raise BootError(
            "L", min(drives), f"another master's {what} is on the bus", "stop that master first"
        )


def _hex(found: int | None) -> str:
    return "not there" if found is None else f"{found:08X}h"


class _NodeBoot:
    """Boots one drive up to pre-operational."""

    def __init__(
        self, network: CanNetwork, node_id: int, profile: DriveProfile, settings: BootSettings
    ) -> None:
        self._network = network
        self._node_id = node_id
        self._profile = profile
        self._settings = settings
        self._dictionary = network.dictionary(node_id)
        self._report = BootReport(node_id)

    def run(self, store_configuration: bool) -> BootReport:
        """Boot the drive; raises BootError, first for a duplicate node id."""
        try:
            self._boot(store_configuration)
        except BootError:
            self._refuse_duplicate()  # a duplicate explains the other failures
            raise
        return self._report

    def _boot(self, store_configuration: bool) -> None:
        network, node_id = self._network, self._node_id
        self._refuse_enabled_drive()
        # a drive that is silent may still answer later
        network.reset_communication(node_id, _BOOT_UP_TIMEOUT_S, self._profile.quirks.boot_ups)
        self._check_identity()
        self._configure()
        timeout_s = 5.0 * self._profile.heartbeat_producer_s + _HEARTBEAT_MARGIN_S
        if network.wait_for_heartbeat(node_id, timeout_s) is None:
            raise self._error("K", "it sends no heartbeat", "check 1017h and the load of the bus")
        self._read_ratings()
        if store_configuration and (self._report.changed or not self._report.stamp_matched):
            self._store()
        self._refuse_duplicate()

    def _error(self, letter: str, problem: str, advice: str) -> BootError:
        return BootError(letter, self._node_id, problem, advice)

    def _read_int(self, index: int, sub: int = 0) -> int:
        return self._network.read_int(self._node_id, index, sub)

    def _read_identity(self, index: int, sub: int) -> int | None:
        """Return the value of an identity object; None if the drive does not have it."""
        try:
            return self._read_int(index, sub)
        except SdoAbortError as error:
            if error.code in ABSENT:
                return None
            raise self._error(
                "B",
                f"it does not give its device type ({error})",
                "switch it off and on; if that does not help, check that it is the intended drive",
            ) from error
        except SdoError as error:
            raise self._error(
                "B",
                f"it does not answer ({error})",
                "check power, wiring, termination, bit rate and the node id set on the drive",
            ) from error

    def _refuse_enabled_drive(self) -> None:
        try:
            state = state_of(self._network.read_int(self._node_id, 0x6041, attempts=1))
        except SdoError:
            return  # the next step reports whether it exists at all
        if state == State.OPERATION_ENABLED:
            raise self._error(
                "L",
                "its power stage is already enabled, so another master uses it",
                "stop the other master, or switch the drive off and on",
            )

    def _refuse_duplicate(self) -> None:
        """Raise BootError if two devices answer under one node id."""
        problem = self._network.duplicate_node(self._node_id, self._profile.quirks.boot_ups)
        if problem:
            raise self._error(
                "B",
                problem,
                "give each device a different node id (connect one alone to see which it is); if "
                "one drive sends its boot-up message twice, set quirks.boot_ups in its profile",
            )

    def _check_identity(self) -> None:
        device = self._read_identity(_DEVICE_TYPE, 0)
        if device is None or device & 0xFFFF != _PROFILE_402:
            raise self._error(
                "C",
                f"its device type is {_hex(device)}, not a CiA 402 drive",
                "check the node id: this may be another device",
            )
        profile = self._profile
        steps = (
            ("D", 1, "vendor id", "vendor_id", profile.vendor_id),
            ("M", 2, "product code", "product_code", profile.product_code),
            ("N", 3, "revision", "revision", profile.revision),
            ("O", 4, "serial number", "serial", profile.serial),
        )
        # only the vendor id is mandatory (CiA 301)
        in_eds = self._dictionary.get(_IDENTITY, ())
        for letter, sub, what, name, expected in steps:
            found = self._read_identity(_IDENTITY, sub) if sub in in_eds else None
            setattr(self._report, name, found or 0)
            if expected is not None and found != expected:
                raise self._error(
                    letter,
                    f"its {what} is {_hex(found)}, the profile {profile.name!r} has "
                    f"{expected:08X}h",
                    "choose the profile of this drive, or connect the intended drive",
                )

    def _configure(self) -> None:
        report = self._report
        try:
            wanted = make_configuration(
                self._profile,
                self._dictionary,
                self._node_id,
                self._settings,
                self._rated_torque_Nm(),
                self._heartbeat_entry(),
            )
            report.absent += wanted.absent
            report.stamp_matched = configure(self._network, self._node_id, wanted, report.changed)
        except DriverError as error:
            if isinstance(error, SdoError) or type(error) is DriverError:
                raise self._error(
                    "J", f"its configuration failed: {error}", "check the profile of the drive"
                ) from error
            raise

    def _store(self) -> None:
        try:
            self._report.stored = store(self._network, self._node_id)
        except SdoError as error:
            raise self._error(
                "J",
                f"its configuration could not be stored: {error}",
                "boot without storing; then each boot writes it",
            ) from error

    def _rated_torque_Nm(self) -> float:
        """Return the motor's rated torque from the drive (6076h), else from the settings."""
        if 0x6076 in self._dictionary:
            return self._read_int(0x6076) * rated_torque_unit_Nm(self._profile)
        return self._settings.rated_torque_Nm or 0.0

    def _counts_per_turn(self) -> tuple[int, int]:
        """Return encoder increments and motor turns from 608Fh."""
        if 0x608F in self._dictionary:
            return self._read_int(0x608F, 1), self._read_int(0x608F, 2)
        return self._settings.counts_per_turn or 0, 1

    def _heartbeat_entry(self) -> int:
        """Return the entry of 1016h that already monitors the master, else the first free one.

        CiA 301 rejects a second entry for one node.
        """
        if 0x1016 not in self._dictionary:
            return 1
        entries = range(1, self._read_int(0x1016) + 1)
        watched = {sub: self._read_int(0x1016, sub) >> 16 & 0x7F for sub in entries}
        for wanted in (self._settings.master_node_id, 0):
            for sub, node in watched.items():
                if node == wanted:
                    return sub
        return 1

    def _device_name(self) -> str:
        """Return 1008h; empty if it cannot be read, because a missing name is no reason to fail."""
        try:
            return str(self._network.read(self._node_id, 0x1008))
        except SdoCancelledError:
            raise
        except SdoError:
            return ""

    def _read_ratings(self) -> None:
        report = self._report
        try:
            report.device_name = self._device_name()
            report.rated_torque_Nm = self._rated_torque_Nm()
            report.torque_constant_Nm_per_Arms = self._settings.torque_constant_Nm_per_Arms
            increments, turns = self._counts_per_turn()
            if 0x6502 in self._dictionary:
                report.supported_modes = self._read_int(0x6502)
            # if the drive lacks 6502h, or reports 0 there, the profile's modes apply
            report.supported_modes = report.supported_modes or mode_bits(
                self._profile.supported_modes
            )
            velocity_unit = self._read_int(0x60A9) if 0x60A9 in self._dictionary else 0
        except SdoError as error:
            raise self._error(
                "J", f"its ratings cannot be read: {error}", "check the drive's EDS"
            ) from error
        if report.rated_torque_Nm <= 0.0 or increments <= 0 or turns <= 0 or increments % turns:
            raise self._error(
                "J",
                f"rated torque {report.rated_torque_Nm} Nm (6076h) or encoder resolution "
                f"{increments}/{turns} (608Fh) are not plausible",
                "set the drive's motor data first",
            )
        if self._profile.torque_unit in CURRENTS_Arms and not report.torque_constant_Nm_per_Arms:
            raise self._error(
                "J",
                f"its torque unit is {self._profile.torque_unit}, but the motor's torque constant "
                "is not known here",
                "choose a drive with another torque unit",
            )
        report.counts_per_turn = increments // turns
        self._check_velocity_unit(velocity_unit)
        self._check_rated_torque(report.rated_torque_Nm)

    def _check_velocity_unit(self, shown: int) -> None:
        """Compare the unit that the drive reports in 60A9h, 0 for none, with the profile's."""
        unit, assumed = VELOCITY_UNITS.get(shown), self._profile.velocity_unit
        if not shown or unit == assumed:
            return
        raise self._error(
            "J",
            f"its velocity unit (60A9h) is {unit or f'{shown:08X}h'}, the profile "
            f"{self._profile.name!r} has {assumed}",
            f'write velocity_unit = "{unit}" into the profile, and acceleration_unit to match'
            if unit
            else "set 60A9h of the drive to revolutions per minute (00B44700h)",
        )

    def _check_rated_torque(self, found_Nm: float) -> None:
        rated_Nm = self._settings.rated_torque_Nm
        if rated_Nm is None or abs(found_Nm - rated_Nm) <= 0.5e-3 + 1e-3 * rated_Nm:
            return
        unit = suspected_unit(self._profile, found_Nm, rated_Nm)
        raise self._error(
            "J",
            f"its rated torque (6076h) is {found_Nm:g} Nm, the motor's profile has {rated_Nm:g} Nm",
            f'the drive seems to count in {unit}: write rated_torque_unit = "{unit}" into its '
            "profile"
            if unit
            else "every torque would be off by this ratio: set the drive's motor data, or choose "
            "the motor that is mounted",
        )
