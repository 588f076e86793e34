"""A rail opened for a command: its drive on CAN or Modbus, its brake, its cables' tensions."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack, contextmanager

import canopen

from cdpr_rt.clock import Clock, PacedClock
from drivers.boot import BootSettings, boot
from drivers.bus import BusUrl
from drivers.bus.leading import open_clock
from drivers.errors import BusError
from drivers.modbus.rail import ModbusRailAxis
from drivers.modbus.tension import TensionSampler
from drivers.network import CanNetwork
from drivers.power_watch import PowerWatch
from drivers.rail import RailAxis
from drivers.rail_cia402 import Cia402RailAxis
from profiles import DriveProfile
from profiles.rail import Cia402Rail, RailProfile
from profiles.rail_drive import load_rail_drive
from profiles.tension_sensor import load_tension_sensors
from tools.errors import BadInputError
from tools.output import Output
from tools.safety import open_safety

# nothing is exchanged with SYNC; the drive only has to be told some period
_SYNC_PERIOD_S = 0.01
_FIRST_READINGS_S = 3.0


@contextmanager
def rail_clock(rail: RailProfile, bus: str | None, winch_buses: Sequence[str]) -> Iterator[Clock]:
    """Yield the clock of a rail's bus and of those of winches; raises BadInputError."""
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
    out: Output,
    clock: Clock,
) -> Iterator[RailAxis]:
    """Get a rail ready to move; however the block ends, its drive has no power afterwards.

    Raises BadInputError for what the rail's kind needs and was not given, and the drivers' errors.
    """
    with ExitStack() as stack:
        if rail.cia402 is None:
            safety = stack.enter_context(open_safety(safety_io, out, clock))
            axis = ModbusRailAxis(rail, clock, safety)
            stack.callback(axis.close)
            axis.open()
            yield axis
            return
        require_options(rail, bus, safety_io)
        url = _bus_of(rail, bus)
        safety = stack.enter_context(open_safety(safety_io, out, clock))
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
    """Raise BadInputError for what the rail's kind needs and was not given."""
    if rail.cia402 is None:
        return
    _bus_of(rail, bus)
    if safety_io is None:
        raise BadInputError(
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
    rail: RailProfile, bus: str | None, winch_buses: Sequence[str], out: Output, clock: Clock
) -> Iterator[Callable[[], str]]:
    """Yield what tells which winch has power, of those on the rail's own bus and on `winch_buses`.

    Raises BadInputError for a bus that cannot be opened.
    """
    asked: list[tuple[BusUrl, list[int]]] = []
    if rail.cia402 is not None:
        asked.append((_bus_of(rail, bus), [rail.cia402.node_id]))
    for text in winch_buses:
        if all(url != _bus_of(rail, text) for url, _ in asked):
            asked.append((_bus_of(rail, text), []))
    with ExitStack() as stack:
        watches = []
        for url, but in asked:
            try:
                watch = PowerWatch(url, clock, but)
            except BusError as error:
                raise BadInputError(str(error)) from error
            stack.callback(watch.close)
            watches.append(watch)
        seen = sum(len(watch.nodes) for watch in watches)
        out.note(
            f"drives beside the rail's that were asked whether they have power: {seen}"
            if seen
            else "no winch's drive was asked whether it has power (--winch-bus)"
        )
        yield lambda: next((text for watch in watches if (text := watch.reason())), "")


@contextmanager
def slack_watch(
    rail: RailProfile, sensors: str | None, port: str | None, checked: bool, clock: Clock
) -> Iterator[Callable[[], str]]:
    """Yield what tells which cable is tight: by load cells, or never where the user has looked.

    Raises BadInputError where neither is given, ModbusError for load cells that do not answer.
    """
    if sensors is None:
        if not checked:
            raise BadInputError(
                "the cables must be slack: name load cells that measure it (--tension, "
                "--tension-port), or look, and say so with --cables-slack-checked"
            )
        yield lambda: ""
        return
    if port is None:
        raise BadInputError("--tension: also name the serial line, --tension-port")
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
        raise BadInputError(f"--bus: {rail.name} is on a CAN bus; name it")
    try:
        url = BusUrl.parse(bus)
    except BusError as error:
        raise BadInputError(str(error)) from error
    if url.starts_own_simulator:
        raise BadInputError(
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
        raise BadInputError(str(error)) from error
    try:
        network.add_node(there.node_id, canopen.import_od(str(drive.eds), there.node_id))
        yield network
    finally:
        network.close()
