"""Measure the Python interface: the start of a robot, and the cost of a controller in Python."""

from __future__ import annotations

import json
import subprocess
import sys
import tempfile
import warnings
from collections.abc import Iterator, Sequence
from contextlib import ExitStack
from pathlib import Path

import numpy as np
from typing_extensions import override

from cdpr_profiles import load_robot
from cdpr_rt.arrays import FloatArray
from cdpr_rt.core.states import LoopState
from cdpr_rt.platform.own_controller import Controller, State, Target
from cdpr_tools.bench.harness import (
    Figures,
    Row,
    Work,
    cost_rows,
    percentiles,
    table_of,
    with_nothing_open,
)
from cdpr_tools.bench.harness import Target as Bound
from cdpr_tools.bench.loop import Run, daemon, with_tolerant_limits
from cdpr_tools.composition.own_code import OwnCode
from cdpr_tools.errors import WorkFailedError
from cdpr_tools.lockstep_robot import LockstepRobot
from cdpr_tools.output import Output

ROBOT, PACED_PERIOD_S = "planar-3", 4e-3
SIMULATED, DAEMON = "cdpr.simulate", "cdpr.run"
BUILT_IN, NOTHING, POSE = "built-in controller", "do-nothing controller", "NumPy pose controller"
_PLACE_m = (0.3, 2.0)
_BLOCK, _WARM_UP = 200, 20
_TIMEOUT_S = 300.0
_SCRIPT = """
import time
begun_s = time.perf_counter()
import json, resource, sys
import cdpr_rt as cdpr
how, name, place = sys.argv[1], sys.argv[2], json.loads(sys.argv[3])
with cdpr.run(name, bus="simbus:") if how == "run" else cdpr.simulate(name) as robot:
    ready_s = time.perf_counter() - begun_s
    robot.enable()
    robot.tighten()
    begins_s = time.perf_counter() - begun_s
    robot.move_to(place)
    moved_s = time.perf_counter() - begun_s
of = [resource.getrusage(who) for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)]
cpu_s = sum(one.ru_utime + one.ru_stime for one in of)
print(json.dumps({"ready": ready_s, "begins": begins_s, "moved": moved_s, "CPU": cpu_s}))
"""


class PoseController(Controller):
    """PID of the pose, and tensions nearest to the middle of their bounds, in NumPy alone."""

    @override
    def reset(self, state: State) -> None:
        """See `Controller.reset`."""
        self.integral = np.zeros_like(state.position)

    @override
    def update(self, state: State, target: Target) -> FloatArray:
        """See `Controller.update`."""
        error = target.position - state.position
        self.integral += state.period_s * error
        force = 1200.0 * (error + 2.0 * self.integral)
        force += 120.0 * (target.velocity - state.velocity)
        W, w, low, high = state.wrench_matrix, state.wrench - force, state.low_N, state.high_N
        t, free = 0.5 * (low + high), np.full(len(low), True)
        while free.any():
            t[free] -= np.linalg.pinv(W[:, free]) @ (W @ t + w)
            outside = np.maximum(low - t, t - high)
            if outside.max() <= 0.0:
                break
            worst = outside.argmax()
            t[worst], free[worst] = np.clip(t[worst], low[worst], high[worst]), False
        return t


class DoNothing(PoseController):
    """Repeats the tensions of the last cycle while `idle` is set; before, it controls the pose."""

    idle = False

    @override
    def update(self, state: State, target: Target) -> FloatArray:
        """See `Controller.update`."""
        return state.tension_N if self.idle else super().update(state, target)


def measure(starts: int, cycles: int, seconds: float, out: Output) -> Figures:
    """Measure `starts` first moves per method, `cycles` cycles in lockstep, and `seconds` paced.

    Raises WorkFailedError if a script fails.
    """
    with tempfile.TemporaryDirectory(prefix="cdpr-bench-") as text:
        folder = Path(text)
        started = _starts(starts, folder, out)
        lockstep = _lockstep(cycles, out)
        paced = _paced(seconds, folder, out)
    over_us = lockstep[NOTHING]["CPU p50"] - lockstep[BUILT_IN]["CPU p50"]
    late = 100.0 * paced[POSE]["late"] / paced[POSE]["cycles"]
    return Figures(
        f"{ROBOT}: a whole cycle in lockstep with each controller, us",
        lockstep,
        {
            "start_s": Bound("simulate, first move p50, s", started[SIMULATED]["moved p50"], 3.0),
            "over_us": Bound("do-nothing controller over the built-in one, us", over_us, 20.0),
            "late": Bound("NumPy controller at 250 Hz, late cycles, %", late, 1.0),
            "off_mm": Bound(
                "NumPy controller at 250 Hz, off its set-point p50, mm",
                paced[POSE]["off by p50, mm"],
                3.0,
            ),
        },
        notes=[
            f"in a daemon at {1.0 / PACED_PERIOD_S:g} Hz, the platform in motion: us a cycle, "
            "and the distance from the set-point",
            table_of(paced),
            "seconds from `import cdpr_rt` until the robot is ready, until its first move begins, "
            "and until this move has ended; processor time of all processes",
            table_of(started),
        ],
        more={"starts": started, "paced": paced, "cycles": cycles, "seconds": seconds},
    )


def _starts(count: int, folder: Path, out: Output) -> dict[str, Row]:
    """Run the script in each way; with a daemon only once, because a daemon moves in real time."""
    robot = with_tolerant_limits(load_robot(ROBOT), folder)
    figures = {}
    for name, how, of, times in (
        (SIMULATED, "simulate", ROBOT, count),
        (DAEMON, "run", str(robot.path), 1),
    ):
        out.note(f"{name}: {times} times ...")
        figures[name] = _start_row([_start(how, of) for _ in range(times)])
    return figures


def _start(how: str, robot: str) -> dict[str, float]:
    arguments = [how, robot, json.dumps(_PLACE_m)]
    done = subprocess.run(
        [sys.executable, "-P", "-c", _SCRIPT, *arguments],
        capture_output=True,
        text=True,
        timeout=_TIMEOUT_S,
        check=False,
    )
    if done.returncode:
        raise WorkFailedError(f"the script with {how} failed: {done.stderr.strip()[-300:]}")
    measured: dict[str, float] = json.loads(done.stdout.splitlines()[-1])
    return measured


def _start_row(runs: Sequence[dict[str, float]]) -> Row:
    return {
        f"{key} {name}": value
        for key in ("ready", "begins", "moved", "CPU")
        for name, value in percentiles([run[key] for run in runs], 50.0, 100.0, digits=2).items()
    }


def _lockstep(cycles: int, out: Output) -> dict[str, Row]:
    """Run whole cycles with each controller, in turns."""
    out.note(f"{cycles} cycles in lockstep with each controller ...")
    nothing = DoNothing()
    controllers = {BUILT_IN: None, NOTHING: nothing, POSE: PoseController()}
    with ExitStack() as stack:
        ways = {}
        for name, mine in controllers.items():
            robot = stack.enter_context(LockstepRobot(ROBOT, own=OwnCode(mine, None, ())))
            robot.enable()
            robot.carry_out("tighten")
            robot.carry_out("pose", position_m=list(_PLACE_m))
            ways[name] = with_nothing_open(_turns(robot))
        nothing.idle = True
        return cost_rows(ways, cycles, _BLOCK, _WARM_UP, (50.0, 99.0))


def _turns(robot: LockstepRobot) -> Iterator[Work]:
    while True:
        yield robot.turn
        if robot.state is not LoopState.ACTIVE:
            raise WorkFailedError(robot.state_text())


def _paced(seconds: float, folder: Path, out: Output) -> dict[str, Row]:
    """Move back and forth in a daemon at 250 Hz, on simulated drives that also run paced."""
    path = folder / "paced.toml"
    shipped = load_robot(ROBOT).path.read_text()
    path.write_text(shipped.replace("sync_period_s = 0.001", f"sync_period_s = {PACED_PERIOD_S}"))
    robot = with_tolerant_limits(load_robot(path), folder)
    rows = {}
    for name, mine in ((BUILT_IN, None), (POSE, f"{__name__}:{PoseController.__name__}")):
        out.note(f"{name} at {1.0 / PACED_PERIOD_S:g} Hz for {seconds:g} s ...")
        with warnings.catch_warnings(action="ignore"):  # a leg may end some mm from its target
            rows[name] = _paced_row(daemon(robot, seconds, folder, mine))
    return rows


def _paced_row(run: Run) -> Row:
    row: Row = {"CPU mean": round(1e6 * run["processor_s"] / len(run["compute_s"]), 1)}
    for name, key in (("computing", "compute_s"), ("late by", "lateness_s")):
        of = percentiles(1e6 * run[key], 50.0, 99.9, digits=1)
        row |= {f"{name} {percent}": value for percent, value in of.items()}
    off = percentiles(1e3 * run["off_m"], 50.0, 99.0, digits=2)
    row |= {f"off by {percent}, mm": value for percent, value in off.items()}
    return row | {"cycles": len(run["compute_s"]), "late": run["late"]}
