"""A rail opened for a command: its drive on CAN or Modbus, its brake, its cables' tensions."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack, contextmanager

from cdpr_drivers.bus import BusUrl
from cdpr_drivers.bus.simulated_bus import open_clock
from cdpr_drivers.canopen.boot.boot import BootSettings, boot
from cdpr_drivers.canopen.network import CanNetwork
from cdpr_drivers.canopen.power_watch import PowerWatch
from cdpr_drivers.errors import BusError, ConfigurationError
from cdpr_drivers.modbus.safety_io import SafetyIo
from cdpr_drivers.modbus.tension import TensionSampler
from cdpr_drivers.rails.rail import RailAxis
from cdpr_drivers.rails.rail_cia402 import Cia402RailAxis
from cdpr_drivers.rails.rail_modbus import ModbusRailAxis
from cdpr_drivers.robot.safety import CLOSED, connect
from cdpr_profiles import DriveProfile
from cdpr_profiles.catalogue import load_rail_drive
from cdpr_profiles.devices.rail import Cia402Rail, RailProfile
from cdpr_profiles.devices.tension_sensor import load_tension_sensors
from cdpr_profiles.eds.dictionary import load_dictionary
from cdpr_rt.core.clock import Clock, PacedClock
from cdpr_rt.procedures.winch_operator import Notifier

# nothing is exchanged with SYNC; the drive only needs some period
_SYNC_PERIOD_S = 0.01
_FIRST_READINGS_S = 3.0
_ASK_S = 0.05


@contextmanager
def rail_clock(rail: RailProfile, bus: str | None, winch_buses: Sequence[str]) -> Iterator[Clock]:
    """Yield the clock of a rail's bus and of those of winches; raises ConfigurationError."""
    named = [*winch_buses] if rail.cia402 is None else [bus, *winch_buses]
    urls = [_bus_of(rail, text) for text in named]
    clock = open_clock({str(url): url for url in urls}.values())
    try:
        yield clock
    finally:
        clock.close()


@contextmanager
def open_rail(
    reference: str,
    rail: RailProfile,
    bus: str | None,
    safety_io: str | None,
    out: Notifier,
    clock: Clock,
) -> Iterator[RailAxis]:
    """Get a rail ready to move; however the block ends, its drive has no power afterwards.

    Raises ConfigurationError for what the rail's kind needs and was not given, and the drivers'
    errors.
    """
    with ExitStack() as stack:
        if rail.cia402 is None:
            safety = stack.enter_context(_open_safety(safety_io, out, clock))
            axis = ModbusRailAxis(rail, clock, safety)
            stack.callback(axis.close)
            axis.open()
            yield axis
            return
        require_options(rail, bus, safety_io)
        url = _bus_of(rail, bus)
        safety = stack.enter_context(_open_safety(safety_io, out, clock))
        assert safety is not None  # one was named
        drive = load_rail_drive(reference, rail.cia402)
        network = stack.enter_context(_network(rail.cia402, drive, url, clock))
        settings = BootSettings(
            rail.cia402.master_node_id, _SYNC_PERIOD_S, rail.cia402.torque_limit_Nm
        )
        report = boot(network, rail.cia402.node_id, drive, settings)
        stack.callback(network.release, rail.cia402.node_id)
        network.start_heartbeat()  # should we die, the drive stops
        yield Cia402RailAxis(rail, drive, network, report, safety)


def require_options(rail: RailProfile, bus: str | None, safety_io: str | None) -> None:
    """Raise ConfigurationError for what the rail's kind needs and was not given."""
    if rail.cia402 is None:
        return
    _bus_of(rail, bus)
    if safety_io is None:
        raise ConfigurationError(
            f"--safety-io: {rail.name} needs the one that has its brake, {rail.cia402.brake_axis!r}"
        )


def position_of(reference: str, rail: RailProfile, bus: str | None) -> float:
    """Return where the carriage is, in m; nothing is written to the drive."""
    if rail.cia402 is None:
        axis = ModbusRailAxis(rail, PacedClock())
        try:
            return axis.position_m()
        finally:
            axis.close()
    there = rail.cia402
    drive = load_rail_drive(reference, there)
    with _network(there, drive, _bus_of(rail, bus), PacedClock()) as network:
        turn = network.read_int(there.node_id, 0x608F, 1)
        counts = network.read_int(there.node_id, 0x6064) - there.zero_counts
        sign = there.direction * drive.position_sign
        return sign * counts * there.travel_per_turn_m / turn


@contextmanager
def power_watch(
    rail: RailProfile, bus: str | None, winch_buses: Sequence[str], out: Notifier, clock: Clock
) -> Iterator[Callable[[], str]]:
    """Yield what tells which winch has power, of those on the rail's own bus and on `winch_buses`.

    Raises ConfigurationError for a bus that cannot be opened.
    """
    asked: list[tuple[BusUrl, list[int]]] = []
    if rail.cia402 is not None:
        asked.append((_bus_of(rail, bus), [rail.cia402.node_id]))
    for text in winch_buses:
        if all(url != _bus_of(rail, text) for url, _ in asked):
            asked.append((_bus_of(rail, text), []))
    with ExitStack() as stack:
        watches = []
        for url, exclude in asked:
            try:
                watch = PowerWatch(url, clock, exclude)
            except BusError as error:
                raise ConfigurationError(str(error)) from error
            stack.callback(watch.close)
            watches.append(watch)
        seen = sum(len(watch.nodes) for watch in watches)
        out.note(
            f"drives beside the rail's that were asked whether they have power: {seen}"
            if seen
            else "no winch's drive was asked whether it has power (--winch-bus)"
        )
        asking = clock.start(lambda: _keep_asking(clock, watches))
        stack.callback(clock.cancel, asking)
        yield lambda: next((text for watch in watches if (text := watch.reason())), "")


def _keep_asking(clock: Clock, watches: Sequence[PowerWatch]) -> None:
    """Ask without end: what is known is as old as a drive is slow to boot, or a disk to write."""
    while True:
        for watch in watches:
            watch.reason()
        clock.sleep(_ASK_S)


@contextmanager
def slack_watch(
    rail: RailProfile, sensors: str | None, port: str | None, checked: bool, clock: Clock
) -> Iterator[Callable[[], str]]:
    """Yield what tells which cable is tight: by load cells, or never where the user has looked.

    Raises ConfigurationError where neither is given, ModbusError for load cells that do not answer.
    """
    if sensors is None:
        if not checked:
            raise ConfigurationError(
                "the cables must be slack: name load cells that measure it (--sensors, "
                "--tension-port), or look, and say so with --cables-slack-checked"
            )
        yield lambda: ""
        return
    if port is None:
        raise ConfigurationError("--sensors: also name the serial line, --tension-port")
    with TensionSampler(load_tension_sensors(sensors), port, clock) as sampler:
        sampler.await_readings(_FIRST_READINGS_S)
        exchange = sampler.exchange

        def tight() -> str:
            exchange.update()
            if reason := exchange.reason():
                return reason
            most = int(exchange.feedback.tension_N.argmax())
            tension = float(exchange.feedback.tension_N[most])
            if tension < rail.slack_below_N:
                return ""
            return f"{exchange.cables[most]} has {tension:.1f} N ({rail.slack_below_N:g} N allowed)"

        yield tight


def _bus_of(rail: RailProfile, bus: str | None) -> BusUrl:
    if bus is None:
        raise ConfigurationError(f"--bus: {rail.name} is on a CAN bus; name it")
    try:
        url = BusUrl.parse(bus)
    except BusError as error:
        raise ConfigurationError(str(error)) from error
    if url.starts_own_simulator:
        raise ConfigurationError(
            "--bus simbus: has no rails; cdpr sim rail starts one, then simbus:NAME"
        )
    return url


@contextmanager
def _network(
    there: Cia402Rail, drive: DriveProfile, url: BusUrl, clock: Clock
) -> Iterator[CanNetwork]:
    heartbeat_s = drive.heartbeat_consumer_s / 4
    try:
        network = CanNetwork(url, clock, [there.node_id], there.master_node_id, heartbeat_s)
    except BusError as error:
        raise ConfigurationError(str(error)) from error
    try:
        network.add_node(there.node_id, load_dictionary(drive.eds, there.node_id))
        yield network
    finally:
        network.close()


@contextmanager
def _open_safety(reference: str | None, out: Notifier, clock: Clock) -> Iterator[SafetyIo | None]:
    """Connect to a safety I/O and close its contactor, for as long as the block runs.

    None where none is named. Raises ModbusError for an I/O that does not answer and SafetyIoError
    where it forbids to energise, or did not open its contactor at the end.
    """
    if reference is None:
        yield None
        return
    with connect(reference, clock) as io:
        io.energise()
        out.note(f"{io.name}: {CLOSED}")
        yield io
