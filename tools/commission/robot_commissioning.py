"""The motors of a robot, each commissioned by itself with its cable detached."""

from __future__ import annotations

import os
from collections.abc import Iterator, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, replace
from pathlib import Path

from cdpr_drivers.bus import BusUrl
from cdpr_drivers.robot.bus_fit import require_fit
from cdpr_drivers.robot.commissioned import folder_of
from cdpr_drivers.robot.robot_buses import robot_urls, starts_own_simulator
from cdpr_profiles import Robot, RobotAxis, Winch
from cdpr_rt.procedures.commissioning.commission_files import Paths
from cdpr_rt.runtime.realtime import one_core
from cdpr_tools.composition.simulator import OwnSimulator
from cdpr_tools.errors import BadInputError
from cdpr_tools.output import Output


@dataclass(frozen=True)
class MotorOfRobot:
    """One axis' motor, as a winch that stands alone, and where its files go."""

    axis: RobotAxis
    winch: Winch
    paths: Paths


def chosen_axes(
    robot: Robot, names: Sequence[str], every: bool, folder: Path
) -> tuple[MotorOfRobot, ...]:
    """Return the motors of the axes called `names`, or of all; files go into `folder`.

    Raises BadInputError for a name that no axis has, and where none or both were asked for.
    """
    known = {axis.name: axis for axis in robot.axes}
    allowed = ", ".join(repr(name) for name in known)
    if every == bool(names):
        raise BadInputError(f"{robot.name}: give --axis NAME ({allowed}) or --all, one of them")
    for name in names:
        if name not in known:
            raise BadInputError(f"--axis {name}: no axis of {robot.name}; allowed: {allowed}")
    chosen = list(known.values()) if every else [known[name] for name in dict.fromkeys(names)]
    return tuple(_motor(robot, axis, folder) for axis in chosen)


def _motor(robot: Robot, axis: RobotAxis, folder: Path) -> MotorOfRobot:
    winch = replace(axis.winch, name=f"{robot.name}, axis {axis.name}")
    return MotorOfRobot(axis, winch, Paths(folder / folder_of(axis)))


@contextmanager
def detached_motors(
    robot: Robot,
    buses: Sequence[str],
    motors: Sequence[MotorOfRobot],
    out: Output,
    plant: Path | None,
) -> Iterator[list[BusUrl]]:
    """Yield the bus of each of `motors`; `simbus:` alone starts drives without cables for it.

    Raises ConfigurationError for a robot that does not fit its buses, and for buses it has not.
    """
    require_fit(robot)
    with ExitStack() as stack:
        if starts_own_simulator(buses):
            name = f"simbus:own-{os.getpid()}"
            out.note(f"starting simulated drives without cables: {len(robot.axes)} ...")
            simulator = OwnSimulator(robot.reference, name, plant, detached=True)
            stack.callback(simulator.stop)
            stack.enter_context(one_core(simulator.process.pid))
            buses = [name]
        elif plant is not None:
            raise BadInputError("--plant: only for a simulator that the command starts (simbus:)")
        urls = robot_urls(robot, buses)
        yield [urls[motor.axis.bus] for motor in motors]


def lines_for_robot(robot: Robot, motors: Sequence[MotorOfRobot]) -> list[str]:
    """Return, for people, how the robot's file refers to the profiles that were made."""
    folder = motors[0].paths.out.parent
    lines = [f"to compensate them: cdpr run {robot.reference} --commissioned {folder}"]
    lines.append("or in the robot's file, under [[axes]]:")
    lines += [f'  {m.axis.name}: commissioned = "{m.paths.out.absolute()}"' for m in motors]
    return lines
