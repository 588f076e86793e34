"""The trial of a path: lines, arcs and cut corners from a G-code file, at speed."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np
from scipy.interpolate import CubicHermiteSpline
from scipy.spatial import KDTree

from cdpr_profiles import Robot
from cdpr_rt.arrays import FloatArray, rms
from cdpr_rt.motion.gcode import GcodeSettings, read_gcode
from cdpr_rt.motion.path_nodes import pieces_of
from cdpr_rt.programs.path_planning import PathPlan, PathPlanner
from cdpr_rt.programs.path_store import write_plan
from cdpr_tools.errors import WorkFailedError
from cdpr_tools.trials.directions import Directions
from cdpr_tools.trials.figures import Figure
from cdpr_tools.trials.recorded import Recorded
from cdpr_tools.trials.run import TrialRun

FILE: Final = "path.nc"
BLEND_mm: Final = 20.0
RMS_mm: Final = 2.0
LATE: Final = 0.01
"""Allowed delay, as a share of the planned duration."""
_LAPS: Final = 3
_SHARE: Final = 0.35
"""Extent of the path on either side of the middle, as a share of the workspace."""
_STEP_m: Final = 5e-4
_LETTERS: Final = {"rx": "A", "ry": "B", "rz": "C", "angle": "C"}
_STANDING_m: Final = 1e-6
_WITHIN_S: Final = 600.0


def gcode(directions: Directions, speed_m_s: float) -> str:
    """Return the file: three laps of lines, an arc and a diagonal, with turns on the way."""
    half = 1e3 * _SHARE * (directions.high_m - directions.low_m)
    x, y = half[0], half[1]
    # the arc must stay in the box, however wide the box is
    left = 1e3 * (0.5 - _SHARE) * (directions.high_m - directions.low_m)[1]
    height = min((2.0 - np.sqrt(3.0)) * x, 0.9 * left)
    radius = (x**2 + height**2) / (2.0 * height)
    up, down = (f" Z{z:.3f}" for z in ((half[2], -half[2]) if directions.k > 2 else (0.0, 0.0)))
    if directions.k == 2:
        up = down = ""
    turn = unturn = ""
    if directions.angle_rad > 0.0:
        letter = _LETTERS[directions.names[directions.k]]
        turn, unturn = f" {letter}{0.4 * np.degrees(directions.angle_rad):.3f}", f" {letter}0"
    lap = [
        f"X{x:.3f}{turn}", f"Y{y:.3f}{up}", f"G3 X{-x:.3f} R{radius:.3f}",
        f"G1 Y{-y:.3f}{down}{unturn}", f"X0 Y{0.5 * y:.3f}", f"X{-x:.3f} Y{-y:.3f}",
    ]  # fmt: skip
    head = ["G21 G90 G17", f"G0 X{-x:.3f} Y{-y:.3f}{down}", f"G64 P{BLEND_mm:g}"]
    head.append(f"G1 F{60e3 * speed_m_s:.1f}")
    return "\n".join([*head, *(_LAPS * lap), "M2", ""])


def plan_of(planner: PathPlanner, directions: Directions, speed_m_s: float) -> PathPlan:
    """Return the plan of the trial's path; raises WorkFailedError if it has no plan."""
    origin = 0.5 * (directions.low_m + directions.high_m)
    settings = GcodeSettings(origin, 0.0)
    path = read_gcode(gcode(directions, speed_m_s), FILE, planner.coordinates, settings)
    plan = planner.plan(path)
    if plan.timed is None or plan.obstacle is not None:
        why = "" if plan.obstacle is None else plan.obstacle.text
        raise WorkFailedError(f"{FILE}: the robot cannot follow it: {why}")
    return plan


def drive(run: TrialRun, speed_m_s: float) -> None:
    """Plan the path, and follow it once."""
    rig = run.rig
    folder = rig.truth_log.parent
    (folder / FILE).write_text(gcode(run.directions, speed_m_s), encoding="utf-8")
    planner = PathPlanner(rig.robot)
    plan = plan_of(planner, run.directions, speed_m_s)
    paths = rig.loop.engine.parts.paths
    assert plan.timed is not None and paths is not None  # the robot has a platform
    paths.open(folder / "plans")
    lines = plan.nodes.line[plan.timed.node]
    name = write_plan(folder / "plans", plan.timed, lines, FILE, planner.model)
    rig.program("path", plan=name)
    rig.until(lambda: rig.progress["path"]["stage"] == "path", _WITHIN_S, "the way to the path")
    run.mark("path", planned_s=plan.timed.duration_s)
    rig.finish(_WITHIN_S + 2.0 * plan.timed.duration_s)
    run.mark("path end")


@dataclass(frozen=True)
class PathErrors:
    """Recorded errors along the path, one row per cycle."""

    time_s: FloatArray
    true_m: FloatArray
    """True positions, (c, k)."""
    described_m: FloatArray
    """Points of the file's path, corners not cut, 0.5 mm apart."""
    off_mm: FloatArray
    """True distance from the planned path, corners cut."""
    setpoint_off_mm: FloatArray
    """Distance of the set-point from the planned path."""
    corner_mm: FloatArray
    """Distance of the planned path from the file's."""
    lag_mm: FloatArray
    """True distance from the set-point of the same cycle."""
    planned_s: float
    taken_s: float


def errors_of(recorded: Recorded, robot: Robot, speed_m_s: float) -> PathErrors:
    """Return the errors of a trial; the path is planned again, from the file."""
    (mark,), (end,) = recorded.marked("path"), recorded.marked("path end")
    rows = slice(recorded.row(mark["cycle"]), recorded.row(end["cycle"]) + 1)
    k = recorded.directions.k
    plan = plan_of(PathPlanner(robot), recorded.directions, speed_m_s)
    planned = _dense(plan)[:, :k]
    described = _described(plan)[:, :k]
    setpoint, true = recorded.setpoint_m[rows], recorded.true_m[rows]
    moving = np.flatnonzero(np.linalg.norm(np.diff(setpoint, axis=0), axis=1) > _STANDING_m * 1e-2)
    return PathErrors(
        recorded.time_s[rows] - recorded.time_s[rows.start],
        true,
        described,
        _away_mm(planned, true),
        _away_mm(planned, setpoint),
        _away_mm(described, planned),
        1e3 * np.linalg.norm(true - setpoint, axis=1),
        float(mark["planned_s"]),
        recorded.period_s * float(moving[-1] - moving[0] + 1),
    )


def _away_mm(points_m: FloatArray, places_m: FloatArray) -> FloatArray:
    """Return the distance of each place from the nearest of some points, (m,)."""
    away_m, _ = KDTree(points_m).query(places_m)
    return 1e3 * np.asarray(away_m)


def _dense(plan: PathPlan) -> FloatArray:
    """Return points of a planned path 0.5 mm apart."""
    parts = []
    for begin, end in plan.nodes.runs:
        s = plan.nodes.s[begin : end + 1]
        spline = CubicHermiteSpline(
            s, plan.nodes.q[begin : end + 1], plan.nodes.first[begin : end + 1]
        )
        parts.append(spline(np.linspace(s[0], s[-1], int((s[-1] - s[0]) / _STEP_m) + 2)))
    return np.concatenate(parts)


def _described(plan: PathPlan) -> FloatArray:
    """Return points of the file's path 0.5 mm apart."""
    pieces = pieces_of(plan.path, plan.nodes.scale)
    count = (pieces.length / _STEP_m).astype(np.int64) + 2
    i = np.repeat(np.arange(len(count)), count)
    number = np.arange(count.sum()) - np.repeat(np.cumsum(count) - count, count)
    return pieces.at(i, number / (count[i] - 1))[0]


def judge(recorded: Recorded, robot: Robot, speed_m_s: float) -> list[Figure]:
    """Return the distances from the path, the deviation in corners, and the time taken."""
    errors = errors_of(recorded, robot, speed_m_s)
    late = abs(errors.taken_s / errors.planned_s - 1.0)
    speed = np.linalg.norm(np.diff(errors.true_m, axis=0), axis=1) / recorded.period_s
    return [
        Figure("planned_s", "planned duration", errors.planned_s, "s"),
        Figure("taken_s", "duration of the set-point's motion", errors.taken_s, "s"),
        Figure("late_share", "relative difference of the two durations", late, "", LATE),
        Figure("top_speed_m_s", "fastest, true", float(speed.max()), "m/s"),
        Figure("path_mm", "RMS distance from the planned path", rms(errors.off_mm), "mm", RMS_mm),
        Figure("path_worst_mm", "worst distance from it", float(errors.off_mm.max()), "mm"),
        Figure("lag_mm", "RMS distance from the set-point", rms(errors.lag_mm), "mm"),
        Figure(
            "corner_mm", "largest distance of the planned path from the file's, in corners",
            float(errors.corner_mm.max()), "mm", BLEND_mm,
        ),
        Figure(
            "setpoint_mm", "largest distance of the set-point from the planned path",
            float(errors.setpoint_off_mm.max()), "mm",
        ),
    ]  # fmt: skip
