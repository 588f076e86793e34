"""The preview of a path before anything moves: its plan, figures and obstacles."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from cdpr_profiles import Robot
from cdpr_profiles.reading.bounded_input import read_text as read_bounded
from cdpr_rt.arrays import FloatArray
from cdpr_rt.motion.path.reading import MOST_BYTES, read_path
from cdpr_rt.procedures.path.planning import Advance, Obstacle, PathPlan, PathPlanner
from cdpr_rt.procedures.path.tensions import PathTensions, path_tensions
from cdpr_rt.procedures.path.unit_slips import size_note
from cdpr_rt.programs.platform.paths.path_progress import paths_folder
from cdpr_rt.programs.platform.paths.path_store import write_plan
from cdpr_tools.output import time_text
from cdpr_tools.paths.options import PathOptions


@dataclass(frozen=True)
class Preview:
    """A plan and the tensions that it takes."""

    planner: PathPlanner
    plan: PathPlan
    tensions: PathTensions | None
    obstacle: Obstacle | None
    note: str


def preview(robot: Robot, file: Path, options: PathOptions, advance: Advance) -> Preview:
    """Plan a file's path for a robot; raises PathError, ProfileError and BadInputError."""
    read_bounded(file, MOST_BYTES)  # a missing file is told before anything is compiled
    planner = PathPlanner(robot)
    advance("reading", 0.0)
    settings = options.settings(planner.model.positions)
    plan = planner.plan(read_path(file, planner.coordinates, settings), advance)
    tensions, obstacle = None, plan.obstacle
    if plan.timed is not None:
        advance("tensions along the path", 0.8)
        tensions = path_tensions(planner.model, plan.timed)
        if not tensions.carried.all():
            sample = int(tensions.sample[int((~tensions.carried).argmax())])
            obstacle = Obstacle(
                int(plan.nodes.line[plan.timed.node[sample]]),
                plan.timed.samples[sample, 0],
                "no tensions within their bounds carry the platform's motion",
            )
    box = planner.platform
    note = size_note(plan.path, np.array(box.workspace_min_m), np.array(box.workspace_max_m))
    return Preview(planner, plan, tensions, obstacle, note)


def keep(shown: Preview, robot: Robot) -> str:
    """Write the plan to where the robot's daemon finds it; return its name."""
    plan, timed = shown.plan, shown.plan.timed
    assert timed is not None  # a path that cannot be followed is not kept
    lines = plan.nodes.line[timed.node]
    title = Path(plan.path.source).name
    return write_plan(paths_folder(robot.profile), timed, lines, title, shown.planner.model)


def figures(shown: Preview) -> dict[str, Any]:
    """Return a preview's figures for JSON."""
    plan, timed, tensions = shown.plan, shown.plan.timed, shown.tensions
    table: dict[str, Any] = {
        "file": plan.path.source,
        "moves": len(plan.path.moves),
        "length_m": plan.nodes.length_m,
        "stops": len(plan.nodes.runs),
        "obstacle": None,
    }
    if shown.obstacle is not None:
        k = shown.planner.model.positions
        table["obstacle"] = {
            "line": shown.obstacle.line,
            "position_m": shown.obstacle.position[:k].tolist(),
            "rotation_rad": shown.obstacle.position[k:].tolist(),
            "text": shown.obstacle.text,
        }
    if timed is not None:
        table |= {
            "duration_s": timed.duration_s,
            "constant_limit_s": plan.constant_s,
            "gain": plan.constant_s / timed.duration_s,
            "top_speed_m_s": _top_speed(shown),
            "slowed_moves": plan.slowed,
        }
    if tensions is not None:
        table |= {
            "tension_min_N": tensions.tension_N.min(axis=0).tolist(),
            "tension_max_N": tensions.tension_N.max(axis=0).tolist(),
            "tension_low_N": tensions.low_N.tolist(),
            "tension_high_N": tensions.high_N.tolist(),
        }
    if shown.note:
        table["note"] = shown.note
    return table


def _top_speed(shown: Preview) -> float:
    timed = shown.plan.timed
    assert timed is not None  # only then it is asked for
    k = shown.planner.model.positions
    return float(np.linalg.norm(timed.samples[:, 1, :k], axis=1).max())


def lines(shown: Preview, robot: Robot, table: dict[str, Any]) -> list[str]:
    """Return a preview for people."""
    length = f"{table['length_m']:.3f} m"
    text = [f"{table['file']}: {table['moves']} moves, {length}, {table['stops']} stops"]
    if shown.note:
        text.append(f"mind: {shown.note}")
    if shown.plan.timed is not None:
        text += [
            f"duration {time_text(table['duration_s'])}, fastest "
            f"{1e3 * table['top_speed_m_s']:.0f} mm/s",
            f"at one speed and acceleration that all of it bears: "
            f"{time_text(table['constant_limit_s'])}, {table['gain']:.1f} times as long",
        ]
    if table.get("slowed_moves"):
        text.append(f"mind: {table['slowed_moves']} moves want more speed than the robot has")
    tensions = shown.tensions
    if tensions is not None:
        text.append("tensions, N:        least   most   planned within")
        least, most = tensions.tension_N.min(axis=0), tensions.tension_N.max(axis=0)
        text += [
            f"  {axis.name:16}{least[i]:8.1f}{most[i]:7.1f}   "
            f"{tensions.low_N[i]:.1f} to {tensions.high_N[i]:.1f}"
            for i, axis in enumerate(robot.axes)
        ]
    return text


def obstacle_text(shown: Preview) -> str:
    """Return where and why a path cannot be followed; an empty text where it can."""
    obstacle = shown.obstacle
    if obstacle is None:
        return ""
    k = shown.planner.model.positions
    place = f"at {_listed(obstacle.position[:k], 1e3)} mm"
    if obstacle.position[k:].any():
        place += f", turned by {_listed(obstacle.position[k:], math.degrees(1.0))} deg"
    return f"{shown.plan.path.source}:{obstacle.line}: {place}: {obstacle.text}"


def _listed(values: FloatArray, factor: float) -> str:
    return ", ".join(f"{factor * value:.1f}" for value in values)
