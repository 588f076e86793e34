"""What it costs to plan a path of a CAM program, and how long the planned motion takes."""

from __future__ import annotations

import importlib.util
import math
import tempfile
import time
from pathlib import Path
from typing import Any

import numpy as np

from cdpr_profiles import load_robot
from cdpr_tools.bench.timing import verdict
from cdpr_tools.output import Output
from cdpr_tools.paths.options import PathOptions
from cdpr_tools.paths.picture import draw_path
from cdpr_tools.paths.preview import Preview, preview

_LARGEST_mm, _SMALLEST_mm = 140.0, 20.0
_ARC_EVERY = 50
_ARC_mm = 8.0


def cam_program(lines: int, seed: int) -> str:
    """Return a program of so many lines: a pocket, level by level, contour by contour inward."""
    chance = np.random.default_rng(seed)
    out = ["%", "(pocket)", "G21 G90 G17 G94", "G0 Z50", "G0 X0 Y0"]
    level = phase = 0.0
    while len(out) < lines - 3:
        level -= 0.5
        phase += 0.3
        out += [f"G0 X{_LARGEST_mm:.3f} Y0", f"G1 Z{level:.3f} F600", "F6000"]
        out += _spiral(chance, phase, lines - 4 - len(out))
        out.append("G0 Z5")
    out = out[: lines - 3]
    return "\n".join([*out, "G0 Z50", "M2", "%", ""])


def _spiral(chance: np.random.Generator, phase: float, most: int) -> list[str]:
    """Return a contour that winds inward, 1 to 4 mm a line, a bulge of two arcs now and then."""
    out: list[str] = []
    radius, angle, count = _LARGEST_mm, 0.0, 0
    while radius > _SMALLEST_mm and len(out) < most:
        angle += 2.0 / radius * chance.uniform(0.5, 2.0)
        radius -= 0.012 * chance.uniform(0.5, 1.5)
        wavy = radius * (1.0 + 0.15 * math.sin(3.0 * angle + phase)) / 1.15
        x, y = wavy * math.cos(angle), wavy * math.sin(angle)
        out.append(f"G1 X{x:.3f} Y{y:.3f}")
        count += 1
        if count % _ARC_EVERY == 0 and len(out) + 2 <= most:
            out.append(f"G3 X{x - _ARC_mm:.3f} I{-0.5 * _ARC_mm:g} J0")
            out.append(f"G2 X{x:.3f} R{0.5 * _ARC_mm:g}")
    return out


ROBOT = "spatial-8"
TARGET_s = 20.0
_LOOKED_AT = 2000
"""Positions through which the library's spline leads; it is given as many a second as ours."""


def measure(lines: int, seed: int, out: Output) -> dict[str, Any]:
    """Return processor time of planning, preview and picture, and durations, beside TOPP-RA's."""
    robot = load_robot(ROBOT)
    platform = robot.platform
    assert platform is not None  # it is one of ours
    middle = 0.5 * (np.array(platform.workspace_min_m) + np.array(platform.workspace_max_m))
    options = PathOptions(" ".join(f"{1e3 * x:.3f}" for x in middle))
    with tempfile.TemporaryDirectory(prefix="cdpr-bench-") as folder:
        file, small = Path(folder) / "cam.nc", Path(folder) / "warm.nc"
        file.write_text(cam_program(lines, seed), encoding="utf-8")
        small.write_text(cam_program(60, seed), encoding="utf-8")
        out.note("compiling ...")
        draw_path(preview(robot, small, options, _quiet), robot, Path(folder) / "warm.png")
        out.note(f"planning {lines} lines ...")
        begun, cpu = time.perf_counter(), time.process_time()
        shown = preview(robot, file, options, _quiet)
        planned = time.process_time()
        draw_path(shown, robot, Path(folder) / "cam.png")
        drawn, drawn_cpu = time.perf_counter(), time.process_time()
    timed = shown.plan.timed
    assert timed is not None and shown.obstacle is None  # it is made to fit
    figures: dict[str, Any] = {
        "lines": lines,
        "seed": seed,
        "robot": ROBOT,
        "nodes": len(shown.plan.nodes.s),
        "samples": len(timed.samples),
        "length_m": shown.plan.nodes.length_m,
        "plan_s": planned - cpu,
        "with_picture_s": drawn_cpu - cpu,
        "wall_s": drawn - begun,
        "duration_s": timed.duration_s,
        "constant_limit_s": shown.plan.constant_s,
        "gain": shown.plan.constant_s / timed.duration_s,
        "target_s": TARGET_s,
        "reached": drawn_cpu - cpu <= TARGET_s,
        "toppra": None,
    }
    if importlib.util.find_spec("toppra") is not None:
        out.note("planning a part of it by the package toppra ...")
        figures["toppra"] = _by_toppra(shown)
    return figures


def report(figures: dict[str, Any]) -> list[str]:
    """Return the figures as lines."""
    ours_us = 1e6 * figures["plan_s"] / figures["nodes"]
    other = figures["toppra"]
    return [
        f"{figures['lines']} lines, seed {figures['seed']}: {figures['length_m']:.1f} m, "
        f"{figures['nodes']} nodes, {figures['samples']} samples",
        f"planned in {figures['plan_s']:.2f} s of processor time, drawn as well in "
        f"{figures['with_picture_s']:.2f} s, wanted at most {figures['target_s']:g} s: "
        f"{verdict(figures['reached'])}; {figures['wall_s']:.2f} s by the wall clock",
        f"the motion takes {figures['duration_s']:.1f} s; at one speed and acceleration throughout "
        f"{figures['constant_limit_s']:.1f} s, {figures['gain']:.1f} times as long",
        "toppra: not installed"
        if other is None
        else f"a node costs {ours_us:.0f} us, reading, corners, tensions, contacts and jerk "
        f"included; toppra {other['us_a_node']:.0f} us with velocity and acceleration alone "
        f"({other['nodes']} nodes), {other['us_a_node'] / ours_us:.1f} times as much",
    ]


def _quiet(_what: str, _part: float) -> None:
    """Tell nobody."""


def _by_toppra(shown: Preview) -> dict[str, float]:
    """Return how long the package takes for the longest run's first nodes, by its own solver.

    The same nodes, limits of velocity and acceleration; it knows no jerk, no feed, and here no
    tensions.
    """
    import toppra  # noqa: PLC0415  # not a part of what is installed with the project
    from toppra import algorithm, constraint  # noqa: PLC0415

    toppra.setup_logging("ERROR")
    nodes, limits = shown.plan.nodes, shown.planner.limits
    begin, end = max(nodes.runs.tolist(), key=lambda run: run[1] - run[0])
    end = min(end, begin + _LOOKED_AT)
    s = nodes.s[begin : end + 1] - nodes.s[begin]
    chosen = np.concatenate([[True], np.diff(s) > 0.0])
    begun = time.process_time()
    path = toppra.SplineInterpolator(s[chosen], nodes.q[begin : end + 1][chosen])
    bounds = [
        constraint.JointVelocityConstraint(limits.velocity),
        constraint.JointAccelerationConstraint(limits.acceleration),
    ]
    algorithm.TOPPRA(
        bounds, path, gridpoints=s[chosen], solver_wrapper="seidel"
    ).compute_trajectory(0, 0)
    taken_s = time.process_time() - begun
    count = int(chosen.sum())
    return {"nodes": count, "plan_s": taken_s, "us_a_node": 1e6 * taken_s / count}
