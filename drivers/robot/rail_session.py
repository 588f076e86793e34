"""A rail opened for a command: its drive on CAN or Modbus, its brake, its cables' tensions."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator, Sequence
from contextlib import ExitStack, contextmanager
from typing import Final

from cdpr_drivers.bus import open_port
from cdpr_drivers.bus.frames import FRAME, FrameReader
from cdpr_drivers.bus.simbus import open_clock
from cdpr_drivers.bus.url import BusUrl
from cdpr_drivers.canopen import sdo as frames
from cdpr_drivers.canopen.boot import BootSettings, boot
from cdpr_drivers.canopen.network import CanNetwork
from cdpr_drivers.cia402 import POWER_OFF, state_of
from cdpr_drivers.errors import BusError, ConfigurationError
from cdpr_drivers.modbus.safety_io import SafetyIo
from cdpr_drivers.modbus.tension import TensionSampler
from cdpr_drivers.robot.rail import Cia402RailAxis, ModbusRailAxis, RailAxis
from cdpr_drivers.robot.safety import CLOSED, connect
from cdpr_profiles import DriveProfile
from cdpr_profiles.catalogue import load_rail_drive
from cdpr_profiles.eds import load_dictionary
from cdpr_profiles.rail import Cia402Rail, RailProfile
from cdpr_profiles.tension_sensor import load_load_cells
from cdpr_rt.core.clock import Clock, PacedClock
from cdpr_rt.loop.operating import Notifier

# Checks by SDO, without booting any drive, whether a drive on a bus has power.

_FUNCTION: Final = 0x780
_UPLOAD: Final = frames.upload_request(0x6041, 0)
_STATUSWORD: Final = frames.multiplexer(0x6041, 0)
_ROUNDS: Final = 2
_WAIT_S: Final = 0.2
"""Time to wait for answers after the last request."""
_ASK_EVERY_S: Final = 0.25
_ANSWER_TIMEOUT_S: Final = 2.0


class PowerWatch:
    """Polls the statuswords (6041h) of all drives on a bus except `exclude`.

    Nodes that do not answer, or refuse, do not count as drives with power: either their control
    supply is off, or they are other devices. Methods raise BusError.
    """

    def __init__(self, url: BusUrl, clock: Clock, exclude: Collection[int]) -> None:
        """Query all node ids and wait for the answers."""
        self.url = url
        self._clock = clock
        self._exclude = frozenset(exclude)
        self._heard_s: dict[int, float] = {}
        self._words: dict[int, int] = {}
        self._reader = FrameReader(open_port(url, [(frames.ANSWER, _FUNCTION)]))
        self._reader.take = self._take
        try:
            for _ in range(_ROUNDS):
                self._ask([node for node in range(1, 128) if node not in exclude])
                clock.sleep(_WAIT_S)
                self._reader.settle()
        except BaseException:
            self._reader.close()
            raise
        self._asked_at_s = clock.now_s

    @property
    def nodes(self) -> list[int]:
        """The drives that have answered."""
        return sorted(self._words)

    def reason(self) -> str:
        """Return which drive has power or no longer answers; else an empty text. Never waits."""
        now_s = self._clock.now_s
        self._reader.settle()
        if now_s - self._asked_at_s > _ASK_EVERY_S:
            self._asked_at_s = now_s
            self._ask(self.nodes)
        for node, word in sorted(self._words.items()):
            state = state_of(word)
            if state not in POWER_OFF:
                return f"node {node} on {self.url} is {state.label}, which means that it has power"
            if now_s - self._heard_s[node] > _ANSWER_TIMEOUT_S:
                return f"node {node} on {self.url} no longer answers: it may have power"
        return ""

    def close(self) -> None:
        """Leave the bus."""
        self._reader.close()

    def _ask(self, nodes: Collection[int]) -> None:
        port = self._reader.port
        try:
            for node in nodes:
                port.send(FRAME.pack(frames.REQUEST + node, 8, _UPLOAD))
        except OSError as error:
            raise port.lost(error) from error

    def _take(self, last: int) -> None:
        for row in self._reader.frames.rows[:last]:
            can_id, length, data = FRAME.unpack_from(row)
            node = can_id - frames.ANSWER
            if node in self._exclude:
                continue  # answers to another master
            # other transfers on the bus are ignored
            if frames.answers(data[:length], _STATUSWORD, frames.UPLOAD):
                value = frames.expedited(data)
                if value is not None:
                    self._words[node] = int.from_bytes(value[:2], "little")
                    self._heard_s[node] = self._clock.now_s


# the rail does not use SYNC, but the drive needs some period
_SYNC_PERIOD_S = 0.01
_FIRST_READINGS_S = 3.0
_ASK_S = 0.05


@contextmanager
def rail_clock(rail: RailProfile, bus: str | None, winch_buses: Sequence[str]) -> Iterator[Clock]:
    """Yield the clock of a rail's bus and the winches' buses; raises ConfigurationError."""
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
    """Open a rail, ready to move; however the block ends, its drive has no power afterwards.

    Raises ConfigurationError for missing options that the rail's kind needs, and the drivers'
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
        assert safety is not None  # checked by require_options
        drive = load_rail_drive(reference, rail.cia402)
        network = stack.enter_context(_network(rail.cia402, drive, url, clock))
        settings = BootSettings(
            rail.cia402.master_node_id, _SYNC_PERIOD_S, rail.cia402.torque_limit_Nm
        )
        report = boot(network, rail.cia402.node_id, drive, settings)
        stack.callback(network.release, rail.cia402.node_id)
        network.start_heartbeat()  # if this process dies, the drive stops
        yield Cia402RailAxis(rail, drive, network, report, safety)


def require_options(rail: RailProfile, bus: str | None, safety_io: str | None) -> None:
    """Raise ConfigurationError for missing options that the rail's kind needs."""
    if rail.cia402 is None:
        return
    _bus_of(rail, bus)
    if safety_io is None:
        raise ConfigurationError(
            f"--safety-io: {rail.name} needs the safety I/O with its brake, "
            f"{rail.cia402.brake_axis!r}"
        )


def position_of(reference: str, rail: RailProfile, bus: str | None) -> float:
    """Return the position of the carriage in m; writes nothing to the drive."""
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
    """Yield a function that returns which winch has power, on the rail's bus and `winch_buses`.

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
            f"other drives that were checked for power: {seen}"
            if seen
            else "no winch was checked for power (--winch-bus)"
        )
        asking = clock.start(lambda: _keep_asking(clock, watches))
        stack.callback(clock.cancel, asking)
        yield lambda: next((text for watch in watches if (text := watch.reason())), "")


def _keep_asking(clock: Clock, watches: Sequence[PowerWatch]) -> None:
    """Poll without end, so that the answers stay recent while a drive boots or a disk writes."""
    while True:
        for watch in watches:
            watch.reason()
        clock.sleep(_ASK_S)


@contextmanager
def slack_watch(
    rail: RailProfile, sensors: str | None, port: str | None, checked: bool, clock: Clock
) -> Iterator[Callable[[], str]]:
    """Yield a function that returns which cable is tight; "" if load cells show none or `checked`.

    Raises ConfigurationError if neither is given, ModbusError if load cells do not answer.
    """
    if sensors is None:
        if not checked:
            raise ConfigurationError(
                "the cables must be slack: give load cells that measure this (--sensors, "
                "--tension-port), or check it yourself and give --cables-slack-checked"
            )
        yield lambda: ""
        return
    if port is None:
        raise ConfigurationError("--sensors: also give the serial port, --tension-port")
    profile, _ = load_load_cells(sensors)
    with TensionSampler(profile, port, clock) as sampler:
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
        raise ConfigurationError(
            f"--bus: is missing; {rail.name} is on a CAN bus, such as simbus:NAME"
        )
    try:
        url = BusUrl.parse(bus)
    except BusError as error:
        raise ConfigurationError(str(error)) from error
    if url.starts_own_simulator:
        raise ConfigurationError(
            "--bus simbus: simulates no rail; start one with `cdpr sim rail`, then give simbus:NAME"
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
    """Connect to a safety I/O and keep its contactor closed while the block runs.

    Yields None if none is named. Raises ModbusError if the I/O does not answer. Raises
    SafetyIoError if it does not allow power, or did not open its contactor at the end.
    """
    if reference is None:
        yield None
        return
    with connect(reference, clock) as io:
        io.energise()
        out.note(f"{io.name}: {CLOSED}")
        yield io
