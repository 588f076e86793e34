"""The thesis' study of calibration: how good by how many poses, and up to which noise."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import numpy as np
from scipy.spatial.transform import Rotation

from cdpr_profiles import load_robot
from cdpr_rt.arrays import FloatArray
from cdpr_rt.calibration.error_model import Errors, Noise, predicted_errors, simulated_errors
from cdpr_rt.robots.platform_model import platform_model_of
from cdpr_tools.errors import BadInputError
from cdpr_tools.jobs import cores, runner
from cdpr_tools.report.style import BACKWARD, FORWARD, canvas, legend_above, legend_beside_title

COUNTS: Final = (6, 10, 20, 50, 100, 150, 200, 300, 400)
SHARES: Final = (0.05, 0.1, 0.25, 0.5, 1.0, 2.0)
"""Of the bounds of table 3.1."""
BOUNDS: Final = {
    "length": Noise(length_m=2.8e-3),
    "position": Noise(position_m=2.0e-3),
    "rotation": Noise(rotation_rad=math.radians(0.4)),
}
"""Table 3.1: noise at which the thesis' model was 20 % off."""
THESIS_mm: Final = {"length": (13.0, 20.0), "position": (5.3, 9.2), "rotation": (2.5, 4.2)}
FIGURES: Final = {
    "3.7": Noise(length_m=3e-3),
    "3.8": Noise(length_m=3e-3, position_m=2e-3, rotation_rad=math.radians(1.0)),
}
_POSES, _TURN_rad = 100, math.radians(30.0)
_TRIES = 400


@dataclass(frozen=True)
class Case:
    """One point of a curve: so much noise at so many poses."""

    name: str
    noise: Noise
    poses: int
    share: float = 1.0


@dataclass(frozen=True)
class _Trials:
    """Trials of one case; `poses` are those of which each draws its own."""

    case: Case
    exits_m: FloatArray
    anchors_m: FloatArray
    poses: FloatArray
    draws: int
    seed: int

    def run(self) -> tuple[Errors, Errors]:
        """Return errors by the model and by trial, the means over other choices of poses too."""
        rng = np.random.default_rng(self.seed)
        model, trial = [], []
        for _ in range(self.draws):
            chosen = self.poses[rng.choice(len(self.poses), self.case.poses, replace=False)]
            known = self.exits_m, self.anchors_m, chosen, self.case.noise
            model.append(predicted_errors(*known))
            trial.append(simulated_errors(*known, 1, rng))
        return _mean(model), _mean(trial)


def held_poses(robot: str, count: int, seed: int) -> FloatArray:
    """Return random poses (N, 4, 3) within the frame, turned by up to 30 deg, that cables hold."""
    profile = load_robot(robot)
    if profile.platform is None or len(profile.platform.controlled) != 6:
        raise BadInputError(f"{robot}: allowed: a robot whose platform has six directions")
    model, rng = platform_model_of(profile), np.random.default_rng(seed)
    workspace = model.workspace(0.0, 0.0)
    exits = np.array(profile.platform.exit_points_m)
    found: list[FloatArray] = []
    for _ in range(_TRIES):
        poses = np.zeros((256, 4, 3))
        poses[:, 0] = rng.uniform(exits.min(axis=0), exits.max(axis=0), (256, 3))
        turns = rng.uniform(-1.0, 1.0, (256, 3)) * _TURN_rad / math.sqrt(3.0)
        poses[:, 1:] = Rotation.from_rotvec(turns).as_matrix() @ model.home_pose.Q
        margins, _ = workspace.margins(poses)
        found += list(poses[margins >= 0.0])
        if len(found) >= count:
            return np.array(found[:count])
    raise BadInputError(f"{robot}: hardly a pose in its frame is held by its cables")


def cases() -> list[Case]:
    """Return all cases of the study."""
    noisy = [
        Case(name, bound.scaled(share), _POSES, share)
        for name, bound in BOUNDS.items()
        for share in SHARES
    ]
    counted = [Case(name, noise, n) for name, noise in FIGURES.items() for n in COUNTS]
    return noisy + counted


def _mean(errors: list[Errors]) -> Errors:
    squares = np.array([(one.exit_m**2, one.offset_m**2) for one in errors]).mean(axis=0)
    return Errors(*np.sqrt(squares).tolist())


def study(
    robot: str, draws: int, seed: int, cluster: str | None, advance: Callable[[float], None]
) -> list[dict[str, Any]]:
    """Return a row of figures for each case, computed on all cores or a Ray cluster.

    Raises CommandError for a robot without six directions, or a cluster that fails.
    """
    every = cases()
    poses = held_poses(robot, 2 * max(COUNTS), seed)
    platform = load_robot(robot).platform
    assert platform is not None  # see `held_poses`
    geometry = np.array(platform.exit_points_m), np.array(platform.anchor_points_m)
    seeds = np.random.SeedSequence(seed).generate_state(len(every)).tolist()
    jobs = [_Trials(case, *geometry, poses, draws, seeds[k]) for k, case in enumerate(every)]
    rows = []
    with runner(cores(), cluster) as run:
        for case, errors in zip(every, run(jobs), strict=True):
            rows.append(_row(case, *errors))
            advance(float(len(rows)))
    return rows


def _row(case: Case, model: Errors, trial: Errors) -> dict[str, Any]:
    return {
        "name": case.name,
        "poses": case.poses,
        "share": case.share,
        "exit_mm": 1e3 * trial.exit_m,
        "offset_mm": 1e3 * trial.offset_m,
        "predicted_exit_mm": 1e3 * model.exit_m,
        "predicted_offset_mm": 1e3 * model.offset_m,
        "ratio": trial.ratio,
        "off": max(trial.exit_m / model.exit_m, trial.offset_m / model.offset_m, key=_distance)
        - 1.0,
    }


def _distance(ratio: float) -> float:
    return abs(ratio - 1.0)


def lines(rows: list[dict[str, Any]]) -> list[str]:
    """Return table 3.1 and the figures' content for people."""
    told = ["noise at 100 poses, one standard deviation, beside the thesis' table 3.1:"]
    told.append(f"{'':10}{'noise':>10}{'e(a) mm':>16}{'e(rho_0) mm':>18}{'ratio':>8}{'model':>9}")
    for row in rows:
        if row["name"] not in BOUNDS:
            continue
        bound = BOUNDS[row["name"]].scaled(row["share"])
        thesis = THESIS_mm[row["name"]] if row["share"] == 1.0 else None
        one, two = (f" ({x:g})" for x in thesis) if thesis else ("", "")
        exits, offsets = f"{row['exit_mm']:.2f}{one}", f"{row['offset_mm']:.2f}{two}"
        told.append(
            f"{row['name']:10}{_shown(bound):>10}{exits:>16}{offsets:>18}{row['ratio']:8.2f}"
            f"{100 * row['off']:+8.1f} %"
        )
    for name in FIGURES:
        told += ["", f"errors by the number of poses, figure {name}:"]
        told += [
            f"{row['poses']:10d}{row['exit_mm']:26.2f}{row['offset_mm']:18.2f}{row['ratio']:8.2f}"
            f"{100 * row['off']:+8.1f} %"
            for row in rows
            if row["name"] == name
        ]
    return told


def _shown(noise: Noise) -> str:
    if noise.rotation_rad:
        return f"{math.degrees(noise.rotation_rad):.3g} deg"
    return f"{1e3 * (noise.length_m + noise.position_m):.3g} mm"


def draw(path: Path, rows: list[dict[str, Any]]) -> None:
    """Write the picture as PNG: errors by the number of poses, the model's by the noise."""
    figure, axes = canvas(1, 3, height=3.1)
    for ax, name in zip(axes, FIGURES, strict=False):
        own = [row for row in rows if row["name"] == name]
        n = [row["poses"] for row in own]
        ends = (("exit", FORWARD, "exit points a"), ("offset", BACKWARD, "initial lengths"))
        for key, colour, label in ends:
            first = ax is axes[0]
            ax.plot(n, [row[f"{key}_mm"] for row in own], "o", ms=4, color=colour,
                    label=f"{label}, trial" if first else None)  # fmt: skip
            ax.plot(n, [row[f"predicted_{key}_mm"] for row in own], color=colour,
                    label="by the model" if first else None)  # fmt: skip
        ax.set(xscale="log", yscale="log", xlabel="poses", ylabel="RMS error (mm)")
        ax.set_title(f"as figure {name}")
    last = axes[2]
    for name, mark in zip(BOUNDS, "os^", strict=True):
        own = [row for row in rows if row["name"] == name]
        last.plot([row["share"] for row in own], [100 * row["off"] for row in own], mark + "-",
                  ms=4, label=name)  # fmt: skip
    last.set(xscale="log", xlabel="noise / that of table 3.1", ylabel="trial over model (%)")
    last.axhspan(-10, 10, color="#888888", alpha=0.12)
    legend_beside_title(last)
    legend_above(figure, axes[0])
    figure.savefig(path, format="png")
