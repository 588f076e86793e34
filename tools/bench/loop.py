"""Measure the cost of the daemon's control loop, compared with a baseline loop in plain Python."""

from __future__ import annotations

import tempfile
import threading
import time
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from websockets.exceptions import ConnectionClosed
from websockets.sync.client import unix_connect

from cdpr_profiles import Robot, load_robot
from cdpr_rt.robot import Robot as RobotHandle
from cdpr_tools.bench import baseline_loop
from cdpr_tools.bench.harness import Figures, Row, Target, percentiles
from cdpr_tools.client.daemon_robot import run
from cdpr_tools.daemon.paths import default_socket
from cdpr_tools.output import Output

ROBOT = "bench-8"
ROUNDS = 3
SLOWER = 4
"""Factor by which the baseline loop also runs slower. At 1 kHz it has no idle time, so its cost
could not be measured."""
_SCHEDULED = 2  # CPUCLOCK_SCHED: as the scheduler counts, to the nanosecond
_SPEED_RAD_S, _TO_AND_FRO_RAD, _BOX_SHARE = 1.0, 3.0, 0.25
_TOLERATED = {
    "missed_cycles": 1000,
    "missed_in_window": 10_000,
    "stale_cycles": 10_000,
    "late_s": 5.0,
}
Run = Mapping[str, Any]
"""Each cycle's `compute_s` and `lateness_s`, `processor_s`, numbers of cycles that were `late` or
`stopped` by a limit, and of `missed` answers."""


def measure(seconds: float, out: Output, name: str = "") -> Figures:
    """Run each variant for `seconds`; raises WorkFailedError and what `cdpr_rt.run` raises.

    The variants take turns, so that other load on the machine affects all equally. `name` selects a
    robot; without it, bare axes turn. The baseline loop turns only bare axes.
    """
    with tempfile.TemporaryDirectory(prefix="cdpr-bench-") as folder:
        robot = with_tolerant_limits(load_robot(name or ROBOT), Path(folder))
        slow = replace(robot, sync_period_s=SLOWER * robot.sync_period_s)
        ours = "ours, recorded and watched"
        runs: dict[str, list[Run]] = {ours: []}
        periods: dict[str, Robot] = {}
        if robot.platform is None:
            periods = {f"canopen and NumPy, {_hertz(of):g} Hz": of for of in (robot, slow)}
            runs |= {way: [] for way in periods}
        for k in range(ROUNDS):
            out.note(f"round {k + 1} of {ROUNDS}: the daemon, then the baseline loop ...")
            runs[ours].append(daemon(robot, seconds / ROUNDS, Path(folder)))
            for way, of in periods.items():
                runs[way].append(baseline_loop.measure(of, seconds / ROUNDS, _SPEED_RAD_S))
    rows = {way: _combined(of) for way, of in runs.items()}
    share = 1e-4 * rows[ours]["computing p99.9"] / robot.sync_period_s
    targets = {"compute_share": Target("computing p99.9, % of the period", share, 30.0)}
    if robot.platform is None:
        ratio = rows[list(rows)[-1]]["host CPU"] / rows[ours]["host CPU"]
        targets["baseline_over_ours"] = Target("baseline loop / ours", ratio, 4.0, True)
    return Figures(
        f"{robot.name}, {len(robot.axes)} axes on {len(robot.buses)} buses, {_hertz(robot):g} Hz: "
        "times in us a cycle, and how many cycles were late, answers missed, and cycles without "
        "torque because a limit was exceeded",
        rows,
        targets,
        more={"robot": name or ROBOT, "seconds": seconds},
    )


def _hertz(robot: Robot) -> float:
    return round(1.0 / robot.sync_period_s, 1)


def _combined(runs: Sequence[Run]) -> Row:
    """Combine rounds; the processor time is the median of the rounds."""
    host_us = [1e6 * run["processor_s"] / len(run["compute_s"]) for run in runs]
    row: Row = {"host CPU": round(float(np.median(host_us)), 1)}
    for name, key in (("computing", "compute_s"), ("late by", "lateness_s")):
        us = 1e6 * np.concatenate([run[key] for run in runs])
        row |= {f"{name} {p}": x for p, x in percentiles(us, 50.0, 99.9, digits=1).items()}
    counts = {key: sum(run[key] for run in runs) for key in ("late", "missed", "stopped")}
    return row | {"cycles": sum(len(run["compute_s"]) for run in runs)} | counts


def with_tolerant_limits(robot: Robot, folder: Path) -> Robot:
    """Return `robot` with a copy of its file in `folder` that only counts missing answers.

    The copy has a separate name, so that no daemon of the user and no state on disk belongs to it.
    """
    path = folder / f"bench-of-{robot.profile}.toml"
    lines = robot.path.read_text().splitlines()
    kept = [line for line in lines if line.split(" =")[0] not in _TOLERATED]
    if "[limits]" not in kept:
        kept.append("[limits]")
    place = kept.index("[limits]") + 1
    limits = [f"{key} = {most}" for key, most in _TOLERATED.items()]
    path.write_text("\n".join([*kept[:place], *limits, *kept[place:], ""]))
    return load_robot(str(path))


def daemon(robot: Robot, seconds: float, folder: Path, controller: str | None = None) -> Run:
    """Run `cdpr run` for a while, with its recording and a client of the live view.

    `controller` is the user's, as for `cdpr run`.
    """
    record = folder / f"recordings-{time.monotonic_ns()}"
    with (
        baseline_loop.simulator(robot) as bus,
        run(robot.path, bus=bus, record=record, controller=controller) as handle,
        _watched(default_socket(robot.profile)),
    ):
        to_and_fro = motion(robot, handle)
        next(to_and_fro)
        pid = int(handle.status["loop"]["pid"])
        begin_ns, begin_s = time.monotonic_ns(), processor_time_s(pid)
        while time.monotonic_ns() < begin_ns + 1e9 * seconds:
            next(to_and_fro)
        processor_s, end_ns = processor_time_s(pid) - begin_s, time.monotonic_ns()
        log = handle.log()
    rows = log[(log["stamp_ns"] >= begin_ns) & (log["stamp_ns"] <= end_ns)]
    return {
        "compute_s": rows["compute_s"],
        "lateness_s": rows["lateness_s"],
        "late": int(rows["late_cycles"][-1] - rows["late_cycles"][0]),
        "missed": int(rows["missed"][-1] - rows["missed"][0]),
        "stopped": 0,
        "processor_s": processor_s,
        "off_m": np.linalg.norm(rows["pose"][:, :3] - rows["pose_setpoint"][:, :3], axis=1),
    }


def motion(robot: Robot, handle: RobotHandle) -> Iterator[None]:
    """Enable the drives and move back and forth; yield after each leg.

    Bare axes turn; a platform goes through the middle of its box.
    """
    handle.enable()
    if robot.platform is None:
        turns = np.array([_TO_AND_FRO_RAD * (-1) ** i for i in range(len(robot.axes))])
        while True:
            for leg in (turns, -turns):
                handle.turn_by(leg, speed_rad_s=_SPEED_RAD_S)
                yield
    handle.tighten("home")
    box = np.array([robot.platform.workspace_min_m, robot.platform.workspace_max_m])
    middle, half = box.mean(axis=0), _BOX_SHARE * (box[1] - box[0])
    while True:
        for sign in (-1.0, 1.0):
            handle.move_to(middle + sign * half)
            yield


def processor_time_s(pid: int) -> float:
    """Return the processor time of all threads of a process, including threads that have ended."""
    # id of the process' clock as from clock_getcpuclockid, which Python does not offer
    return time.clock_gettime_ns((~pid << 3) | _SCHEDULED) * 1e-9


@contextmanager
def _watched(control: Path) -> Iterator[None]:
    """Let a client read the live view as fast as possible within the block."""
    with unix_connect(str(control), "ws://daemon/live?rate_Hz=50") as view:
        view.recv()

        def take() -> None:
            with suppress(ConnectionClosed):
                for _ in view:
                    pass

        taker = threading.Thread(target=take)
        taker.start()
        try:
            yield
        finally:
            view.close()
            taker.join()
