"""Drives opened for a command, with a simulator of its own where it asks for one."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import replace
from functools import partial
from pathlib import Path

from cdpr_drivers.bus import BusUrl
from cdpr_drivers.bus.budget import HEARTBEATS_IN_TOLERANCE
from cdpr_drivers.bus.simulated_bus import open_clock
from cdpr_drivers.canopen.network import CanNetwork
from cdpr_drivers.errors import BusError
from cdpr_drivers.robot.bus_fit import require_fit
from cdpr_drivers.robot.robot_buses import starts_own_simulator
from cdpr_drivers.robot.safety import CLOSED
from cdpr_drivers.robot.session import Session, booted
from cdpr_drivers.robot.session_watch import Watching, no_watches
from cdpr_profiles import Robot, Winch
from cdpr_profiles.eds.dictionary import load_dictionary
from cdpr_profiles.robot import robot_of_winch
from cdpr_rt.procedures.winch_operator import Tolerance
from cdpr_rt.runtime.realtime import one_core
from cdpr_rt.runtime.warm_up import warm_up
from cdpr_tools.composition.simulator import OwnSimulator
from cdpr_tools.consent import require_consent
from cdpr_tools.errors import BadInputError, raised_as
from cdpr_tools.output import Output
from cdpr_tools.signals import StopRequest, stop_on_signals


def open_bus(text: str) -> BusUrl:
    """Return the bus that `text` names; raises BadInputError."""
    with raised_as(BadInputError, BusError):
        return BusUrl.parse(text)


def confirm_motion(url: BusUrl, yes: bool, what: str) -> None:
    """Ask before a real motor is energised; raises BadInputError when nobody agrees."""
    require_consent(f"{what} on {url}: the motor will turn.", yes or url.is_simulated)


@contextmanager
def open_network(
    winch: Winch, url: BusUrl, out: Output, plant: Path | None = None
) -> Iterator[CanNetwork]:
    """Join the bus for acyclic work, with a simulator of its own where `simbus:` has no name.

    Raises ConfigurationError for a cycle that does not fit the bus, and BadInputError for a bus
    that cannot be opened.
    """
    require_fit(winch)
    with ExitStack() as stack:
        bus, _ = find_bus(stack, winch, url, out, plant)
        clock = open_clock([bus])
        stack.callback(clock.close)
        heartbeat_s = _heartbeat_s(winch)
        with raised_as(BadInputError, BusError):
            network = CanNetwork(bus, clock, [winch.node_id], winch.master_node_id, heartbeat_s)
        stack.callback(network.close)
        network.add_node(winch.node_id, load_dictionary(winch.drive.eds, winch.node_id))
        yield network


@contextmanager
def open_winch(
    winch: Winch,
    url: BusUrl,
    out: Output,
    plant: Path | None = None,
    truth_log: Path | None = None,
    safety_io: str | None = None,
    watching: Watching = no_watches,
    tolerance: Tolerance | None = None,
    reset: bool = False,
) -> Iterator[Session]:
    """Boot the winch's drive on `url` and get ready to run its axis, in its torque mode.

    With `safety_io`, the profile of a safety I/O, there is power only while that allows it;
    what `watching` opens by the robot's clock is asked every cycle besides. A drive in fault is
    refused, or acknowledged with `reset`. Whatever ends the block, the drive's power stage is off
    afterwards. Raises ConfigurationError for a bus that cannot be opened, what `watching` and the
    safety I/O raise, and the drivers' errors for a drive that does not boot.
    """
    require_fit(winch)
    with ExitStack() as stack:
        stop_requested = stack.enter_context(stop_on_signals())
        robot = robot_of_winch(winch)
        bus, pid = find_bus(stack, winch, url, out, plant, truth_log, _compiled(robot))
        axis = replace(robot.axes[0], winch=winch)  # whose drive waits as long as its profile says
        robot = replace(robot, axes=(axis,), master_heartbeat_s=_heartbeat_s(winch))
        session = stack.enter_context(
            booted(robot, [str(bus)], stop_requested, safety_io, watching, tolerance)
        )
        stack.callback(stop_requested.closing)  # before the power is taken
        session.simulator_pid = pid
        _prepare(session, stop_requested, out, reset)
        yield session


@contextmanager
def open_robot(
    robot: Robot,
    buses: Sequence[str],
    out: Output,
    *,
    safety_io: str | None = None,
    reset: bool = False,
) -> Iterator[Session]:
    """Boot all drives of `robot`, and get ready to run its axes as `open_winch` does.

    `buses` are what was given with --bus; `simbus:` alone starts a simulator of all buses. Where
    no `safety_io` is named the robot's own counts, unless all buses are simulated.
    """
    require_fit(robot)
    with ExitStack() as stack:
        stop_requested = stack.enter_context(stop_on_signals())
        pid = None
        if starts_own_simulator(buses):
            out.note(f"starting simulated drives: {len(robot.axes)} ...")
            buses, pid = _own_simulator(stack, robot.reference, meanwhile=_compiled(robot))
        session = stack.enter_context(booted(robot, buses, stop_requested, safety_io))
        stack.callback(stop_requested.closing)  # before the power is taken
        session.simulator_pid = pid
        _prepare(session, stop_requested, out, reset)
        yield session


def _prepare(session: Session, stop_requested: StopRequest, out: Output, reset: bool) -> None:
    """Check the cycles of a booted session, and tell what is to be known of its drives."""
    stop_requested.energised = True
    session.check(reset)
    for notice in (*session.machine.notices, *session.loop.engine.notices):
        out.note(notice)
    if session.machine.safety:
        out.note(f"{session.machine.safety}: {CLOSED}")


def _compiled(robot: Robot) -> Callable[[], None]:
    """Return what compiles the master's cycle: worth doing while a simulator compiles physics."""
    return partial(warm_up, len(robot.axes), robot.sync_period_s)


def _heartbeat_s(winch: Winch) -> float:
    """Return how often the master is heard within what the drive tolerates."""
    return winch.drive.heartbeat_consumer_s / HEARTBEATS_IN_TOLERANCE


def find_bus(
    stack: ExitStack,
    winch: Winch,
    url: BusUrl,
    out: Output,
    plant: Path | None,
    truth_log: Path | None = None,
    meanwhile: Callable[[], None] | None = None,
    board: Path | None = None,
) -> tuple[BusUrl, int | None]:
    """Return the winch's bus, and the process of its simulator where one was to be started.

    What is to be done `meanwhile` is done while that starts.
    """
    if url.starts_own_simulator:
        out.note("starting the simulated drive ...")
        (bus,), pid = _own_simulator(stack, winch.reference, plant, truth_log, meanwhile, board)
        return open_bus(bus), pid
    if plant is not None:
        raise BadInputError("--plant: only for a simulator that the command starts (simbus:)")
    return url, None


def _own_simulator(
    stack: ExitStack,
    reference: str,
    plant: Path | None = None,
    truth_log: Path | None = None,
    meanwhile: Callable[[], None] | None = None,
    board: Path | None = None,
) -> tuple[list[str], int]:
    bus = f"simbus:own-{os.getpid()}"
    simulator = OwnSimulator(reference, bus, plant, truth_log, board=board, meanwhile=meanwhile)
    stack.callback(simulator.stop)
    stack.enter_context(one_core(simulator.process.pid))
    return [bus], simulator.process.pid
