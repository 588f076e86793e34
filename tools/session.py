"""One winch on a bus, opened for a command and left without power, however the command ends."""

from __future__ import annotations

import math
import os
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import Any

from cdpr_rt.cogging_profile import DriveIdentity
from cdpr_rt.errors import NotInTimeError, TripError
from cdpr_rt.executive import Executive
from cdpr_rt.realtime import one_core, paced_realtime
from cdpr_rt.rehearsal import rehearse
from cdpr_rt.supervisor import Limits, Supervisor
from drivers import touch_probe
from drivers.axis_group import AxisGroup
from drivers.axis_layout import AxisConfig
from drivers.boot import BootReport, BootSettings, boot
from drivers.bus import BusUrl, query_status
from drivers.bus.budget import HEARTBEATS_IN_TOLERANCE
from drivers.bus.leading import open_clock
from drivers.bus.master_lock import MasterLock
from drivers.cia402 import Mode, State, fault_text
from drivers.data_sheet import load_dictionary
from drivers.errors import BusError, DriveFaultError, SdoError
from drivers.homing import Homing
from drivers.network import CanNetwork
from profiles import Winch
from tools.bus_fit import require_fit
from tools.consent import require_consent
from tools.errors import BadInputError
from tools.output import Output
from tools.safety import SessionSafety, open_safety
from tools.signals import stop_on_signals
from tools.simulator import OwnSimulator
from tools.tension.session_watch import Watching, no_watches

_SPEED_SHARE = 0.2
# a bare rotor may swing by turns without doing harm; its speed is what is limited
_FOLLOWING_ERROR_RAD = 4.0 * math.tau
_INDEX_TIMEOUT_S = 30.0
# what makes a drive stop by itself once nobody leads it, and bounds its torque until then
_GUARDS = ("1016h", "6007h", "605Ah", "6072h")


class WinchSession:
    """A booted winch and the executive that runs its axis."""

    def __init__(
        self,
        winch: Winch,
        url: BusUrl,
        network: CanNetwork,
        device: AxisGroup,
        executive: Executive,
        report: BootReport,
        safety: SessionSafety | None = None,
    ) -> None:
        self.winch = winch
        self.url = url
        self.network = network
        self.device = device
        self.executive = executive
        self.boot = report
        self.safety = safety
        self._paused_watch: list[tuple[int, int]] = []

    @property
    def latency_s(self) -> float:
        """From the instant an angle was true to the middle of the cycle its torque acts in."""
        return latency_s(self.winch)

    def expect_index(self) -> None:
        """Have the drive latch its index in the ordinary motion that follows (touch probe)."""
        touch_probe.arm(self.device, 0)

    def restrict(self, speed_rad_s: float, following_error_rad: float) -> None:
        """Tolerate less speed and following error than a bare rotor under test may have."""
        usual = self.executive.supervisor.limits
        limits = Limits(usual.torque_Nm, speed_rad_s, following_error_rad)
        self.executive.supervisor = Supervisor(limits, self.device.n, self.device.period_s)

    def reset_fault(self) -> None:
        """Acknowledge the drive's fault; it is left without power. Raises TripError if it stays."""
        device = self.device
        device.sync()
        device.receive()
        device.transmit()
        device.acknowledge_fault()
        self._lead_to(State.SWITCH_ON_DISABLED)
        device.stop_cycling()

    def idle(self, seconds: float) -> None:
        """Run cycles without torque for a while."""
        cycles = iter(range(round(seconds / self.device.period_s)))
        self.executive.step(lambda: next(cycles, None) is None, seconds + 1.0, "the end")

    @property
    def drive_identity(self) -> DriveIdentity:
        """What a cogging profile is bound to, besides the motor."""
        return identity_of(self.boot)

    @property
    def identity(self) -> dict[str, Any]:
        """What raw data keep of where they come from."""
        whose = {"winch": self.winch.reference, "motor": self.winch.motor.model}
        return whose | self.drive_identity.model_dump()

    def set_mode(self, mode: int) -> None:
        """Ask for a mode of operation and wait until the drive confirms it.

        Raises ModeRefusedError when it does not.
        """
        self.device.ask_mode(mode)
        timeout = self.winch.drive.mode_display_timeout_s
        try:
            self.executive.step(self.device.mode_confirmed, timeout, "the mode's confirmation")
        except NotInTimeError as error:
            if self.device.mode_confirmed():
                raise
            raise self.device.unconfirmed_mode() from error

    def enable(self) -> None:
        """Switch the power stage on; the torque is zero until a controller runs."""
        self.network.resume_watch(self.winch.node_id, self._paused_watch)
        self._paused_watch = []
        self._lead_to(State.OPERATION_ENABLED)
        if self.safety is not None:
            self.safety.release_brakes(self.executive)

    def disable(self) -> None:
        """Switch the power stage off, so that computation may take its time."""
        if self.safety is not None:
            self.safety.apply_brakes(self.executive)
        self._lead_to(State.SWITCH_ON_DISABLED)
        self.device.stop_cycling()
        # a drive that was disabled before watches nothing now, and is to watch again all the same
        self._paused_watch += self.network.pause_watch(self.winch.node_id) or []

    def _lead_to(self, state: State) -> None:
        self.device.request(state)
        timeout = 4.0 * self.winch.drive.state_timeout_s
        what = f"node {self.winch.node_id}: the state {state.label!r}"
        self.executive.step(lambda: self.device.reached(state), timeout, what)

    def find_index(self, method: int = 34) -> None:
        """Find the encoder index by homing, which turns the motor by up to a turn."""
        homing = Homing(self.device, 0, method, _INDEX_TIMEOUT_S)
        homing.configure()
        self.set_mode(Mode.HOMING)
        self.enable()
        try:
            # the procedure keeps its own time; the executive's is there for a drive gone deaf
            what = "the encoder index (homing)"
            self.executive.step(homing.update, 2.0 * _INDEX_TIMEOUT_S, what)
        except BaseException:
            homing.abort()
            raise
        self.disable()

    def sync_offset(self) -> int:
        """Return how many SYNCs a simulated bus had seen before our first cycle."""
        return int(self.bus_status().get("sync_count", 0)) - self.device.feedback.cycle

    def bus_status(self) -> dict[str, Any]:
        """Return what a simulated bus tells of itself, an empty table on others."""
        return query_status(self.url.channel) if self.url.is_simulated else {}


def identity_of(report: BootReport) -> DriveIdentity:
    """Return what a cogging profile is bound to, besides the motor, of a drive that has booted."""
    return DriveIdentity(
        vendor_id=report.vendor_id,
        product_code=report.product_code,
        revision=report.revision,
        serial=report.serial,
        encoder_counts_per_turn=report.counts_per_turn,
    )


def latency_s(winch: Winch) -> float:
    """Return the nominal time from a true angle to the middle of the cycle its torque acts in."""
    drive = winch.drive
    return drive.feedback_delay_s + drive.torque_delay_s + 1.5 * winch.sync_period_s


def _fault_of(network: CanNetwork, node_id: int) -> str:
    try:
        code = network.read_int(node_id, 0x603F)
    except SdoError:
        return "the drive does not say why"
    return fault_text(code) if code else "no code given (603Fh = 0)"


def open_bus(text: str) -> BusUrl:
    """Return the bus that `text` names; raises BadInputError."""
    try:
        return BusUrl.parse(text)
    except BusError as error:
        raise BadInputError(str(error)) from error


def confirm_motion(url: BusUrl, yes: bool, what: str) -> None:
    """Ask before a real motor is energised; raises BadInputError when nobody agrees."""
    require_consent(f"{what} on {url}: the motor will turn.", yes or url.is_simulated)


@contextmanager
def open_network(
    winch: Winch,
    url: BusUrl,
    out: Output,
    plant: Path | None = None,
    truth_log: Path | None = None,
) -> Iterator[CanNetwork]:
    """Join the bus for acyclic work, with a simulator of its own where `simbus:` has no name.

    Raises BadInputError for a cycle that does not fit the bus, and for a bus that cannot be opened.
    """
    require_fit(winch)
    with ExitStack() as stack:
        if url.starts_own_simulator:
            url = _own_simulator(stack, winch, out, plant, truth_log)
        elif plant is not None:
            raise BadInputError("--plant: only for a simulator that the command starts (simbus:)")
        drive = winch.drive
        clock = open_clock([url])
        stack.callback(clock.close)
        try:
            network = CanNetwork(
                url, clock, [winch.node_id], winch.master_node_id, _heartbeat_s(winch)
            )
        except BusError as error:
            raise BadInputError(str(error)) from error
        stack.callback(network.close)
        network.add_node(winch.node_id, load_dictionary(drive.eds, winch.node_id))
        yield network


def _only_master(url: BusUrl) -> MasterLock:
    try:
        return MasterLock(url)
    except BusError as error:
        raise BadInputError(str(error)) from error


@contextmanager
def open_winch(
    winch: Winch,
    url: BusUrl,
    out: Output,
    plant: Path | None = None,
    truth_log: Path | None = None,
    safety_io: str | None = None,
    watching: Watching = no_watches,
) -> Iterator[WinchSession]:
    """Boot the winch's drive on `url` and get ready to run its axis.

    With `safety_io`, the profile of a safety I/O, there is power only while that allows it;
    what `watching` opens by the robot's clock is asked every cycle besides. Whatever ends the
    block, the drive's power stage is off afterwards. Raises what `open_network`, `watching` and
    `open_safety` raise and the drivers' errors for a drive that does not boot.
    """
    with ExitStack() as stack:
        stop_requested = stack.enter_context(stop_on_signals())
        rehearse(1, winch.sync_period_s)  # compiling keeps a poll waiting
        network = stack.enter_context(open_network(winch, url, out, plant, truth_log))
        clock = network.clock
        stack.enter_context(_only_master(network.url))
        watches = stack.enter_context(watching(clock))
        safety = stack.enter_context(open_safety(safety_io, out, [winch.node_id], clock))
        limit = winch.motor.rated_torque_Nm
        report = boot(network, winch.node_id, winch.drive, boot_settings(winch))
        stack.callback(network.release, winch.node_id)
        device = stack.enter_context(_axis(winch, network, report, limit))
        if safety is not None:
            stack.callback(safety.drop_brakes)
        stack.callback(stop_requested.closing)  # before what is closed above
        stop_requested.energised = True
        lacking = lacking_guards(f"node {winch.node_id}", report)
        if lacking:
            out.note(lacking)
        network.start_heartbeat()
        if not device.lockstep:
            for notice in stack.enter_context(paced_realtime()):
                out.note(notice)
        limits = Limits(limit, _SPEED_SHARE * winch.motor.rated_speed_rad_s, _FOLLOWING_ERROR_RAD)
        supervisor = Supervisor(limits, device.n, device.period_s)
        if safety is not None:
            watches = (safety.io, *watches)
        executive = Executive(device, supervisor, stop_requested, watches)
        try:
            yield WinchSession(winch, network.url, network, device, executive, report, safety)
        except TripError as error:
            reason, faulted = str(error), device.faulted().any()
            if faulted and (code := _fault_of(network, winch.node_id)) not in reason:
                reason = f"{reason}: {code}"
            if safety is not None:
                reason = safety.cause(reason)
            raise (DriveFaultError if faulted else TripError)(reason) from error


def lacking_guards(node: str, report: BootReport) -> str:
    """Return what to look at where a drive lacks what makes it stop by itself, else nothing."""
    lacking = [name for name in report.absent if name.startswith(_GUARDS)]
    if not lacking:
        return ""
    return f"{node} lacks {', '.join(lacking)}: check what stops it when its master falls silent"


def boot_settings(winch: Winch) -> BootSettings:
    """Return what the master wants of a winch's drive besides its profile."""
    return BootSettings(
        winch.master_node_id,
        winch.sync_period_s,
        winch.motor.rated_torque_Nm,
        rated_torque_Nm=winch.motor.rated_torque_Nm,
        counts_per_turn=winch.encoder_counts_per_turn,
    )


def _heartbeat_s(winch: Winch) -> float:
    """Return how often the master is heard within what the drive tolerates."""
    return winch.drive.heartbeat_consumer_s / HEARTBEATS_IN_TOLERANCE


def _axis(winch: Winch, network: CanNetwork, report: BootReport, limit_Nm: float) -> AxisGroup:
    axis = AxisConfig.from_boot(winch.drive, report, limit_Nm)
    return AxisGroup(network, [axis], winch.sync_period_s)


def _own_simulator(
    stack: ExitStack, winch: Winch, out: Output, plant: Path | None, truth_log: Path | None
) -> BusUrl:
    url = open_bus(f"simbus:own-{os.getpid()}")
    out.note("starting the simulated drive ...")
    simulator = OwnSimulator(winch.reference, str(url), plant, truth_log)
    stack.callback(simulator.stop)
    stack.enter_context(one_core(simulator.process.pid))
    return url
