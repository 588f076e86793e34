"""The thesis' study of calibration: accuracy by number of poses and by noise.

The model of Tremblay, section 3.5: with c = p + Q b - a and ρ = ρ_0 + Δρ, (3.40) is

    c^T δa + ρ δρ_0 = c^T δp + (b × Q^T c)^T δr - ρ δΔρ

Its least-squares solution is (3.63), D^+ K δy; D has one block per cable, and δr turns about axes
of the platform, as in (3.54). The trial solves (3.20) directly, by Gauss-Newton with (3.25). δy is
`unit` (N, n + 6), for cables, position and turn at each pose, times a noise (3,): of lengths in m,
positions in m and rotations in rad. Errors (n, 4) are those of each cable's exit point and initial
length, in m.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from scipy.spatial.transform import Rotation

from cdpr_profiles import load_robot
from cdpr_rt.arrays import FloatArray
from cdpr_rt.model.platform_model import platform_model_of
from cdpr_tools.errors import BadInputError
from cdpr_tools.output import TableText
from cdpr_tools.processes import cores, runner
from cdpr_tools.style import BACKWARD, FORWARD, canvas, legend_above, save_figure

COUNTS: Final = (6, 10, 20, 50, 100, 150, 200, 300, 400)
SHARES: Final = (0.05, 0.1, 0.25, 0.5, 1.0, 2.0, 4.0)
"""Shares of the bounds of table 3.1, or of `BIASES`."""
PAIR_SHARES: Final = (0.33, 0.67, 1.0)
BOUNDS: Final = {
    "length": np.array([2.8e-3, 0.0, 0.0]),
    "position": np.array([0.0, 2.0e-3, 0.0]),
    "rotation": np.array([0.0, 0.0, math.radians(0.4)]),
}
"""Table 3.1: noise at which the thesis' model was off by 20 %."""
BIASES: Final = {**BOUNDS, "rotation": 5.0 * BOUNDS["rotation"]}
"""Section 3.5.3 gives 2 deg as the bound of a bias in rotation, and no bounds for the others."""
PAIRS: Final = {
    "C.1, C.2": ("position", "length"),
    "C.3, C.4": ("position", "rotation"),
    "C.5, C.6": ("length", "rotation"),
}
THESIS_mm: Final = {"length": (13.0, 20.0), "position": (5.3, 9.2), "rotation": (2.5, 4.2)}
FIGURES: Final = {
    "3.7": np.array([3e-3, 0.0, 0.0]),
    "3.8": np.array([3e-3, 2e-3, math.radians(1.0)]),
}
_POSES, _TURN_rad = 100, math.radians(30.0)
_TRIES = 400
_STEPS = 12
_DIRECTION: Final = (1.0 / 3.0, 2.0 / 3.0, 2.0 / 3.0)
"""Direction of a bias of position and rotation: arbitrary, but the same in all trials."""
_NONE_m: Final = 1e-9
"""Errors below this come only from rounding."""
_ENDS: Final = (("exit", FORWARD, "exit points a"), ("offset", BACKWARD, "initial lengths ρ_0"))
_UNITS: Final = {
    "length": ("length_mm", "lengths (mm)"),
    "position": ("position_mm", "position (mm)"),
    "rotation": ("rotation_deg", "rotation (deg)"),
}

Rows = list[dict[str, Any]]


@dataclass(frozen=True)
class StudyCase:
    """One point of a curve: an amount of noise, or bias, and a number of poses."""

    name: str
    figure: str
    noise: FloatArray
    poses: int = _POSES
    share: float | None = None
    """Factor of the value in `BOUNDS` or `BIASES`."""
    bias: bool = False


@dataclass(frozen=True)
class Trials:
    """Trials of one case; each draws its own poses from `poses`."""

    case: StudyCase
    exits_m: FloatArray
    anchors_m: FloatArray
    poses: FloatArray
    draws: int
    seed: int

    def run(self) -> dict[str, Any]:
        """Return the figures of the case for JSON: errors by the model and by trial.

        They are root mean squares over all draws, each with its own choice of poses.
        """
        rng, case = np.random.default_rng(self.seed), self.case
        cables, count = len(self.exits_m), case.poses
        same = np.tile([*[1.0] * cables, *_DIRECTION, *_DIRECTION], (count, 1))
        predicted, tried = [], []
        for _ in range(self.draws):
            chosen = self.poses[rng.choice(len(self.poses), count, replace=False)]
            known = self.exits_m, self.anchors_m, chosen, case.noise
            unit = same if case.bias else rng.normal(size=(count, cables + 6))
            predicted.append(
                predicted_errors(*known, unit) if case.bias else predicted_spread(*known)
            )
            tried.append(simulated_errors(*known, unit))
        model_m, trial_m = rms_errors_m(np.array(predicted)), rms_errors_m(np.array(tried))
        # relative excess of a trial over the model; None if the model's error is only rounding
        offs = [
            trial / model - 1.0 if model > _NONE_m else None
            for trial, model in zip(trial_m, model_m, strict=True)
        ]
        known_offs = [off for off in offs if off is not None]
        return {
            "name": case.name,
            "figure": case.figure,
            "poses": case.poses,
            "share": case.share,
            "length_mm": 1e3 * float(case.noise[0]),
            "position_mm": 1e3 * float(case.noise[1]),
            "rotation_deg": math.degrees(case.noise[2]),
            "exit_mm": 1e3 * trial_m[0],
            "offset_mm": 1e3 * trial_m[1],
            "predicted_exit_mm": 1e3 * model_m[0],
            "predicted_offset_mm": 1e3 * model_m[1],
            "ratio": trial_m[1] / trial_m[0] if len(known_offs) == 2 else None,
            "off_exit": offs[0],
            "off_offset": offs[1],
            "off": max(known_offs, key=abs),
        }


def predicted_spread(
    exits_m: FloatArray, anchors_m: FloatArray, poses: FloatArray, noise: FloatArray
) -> FloatArray:
    """Return the standard deviations (n, 4) by (3.63), for anchors (n, 3) and poses (N, 4, 3)."""
    D, by_turn = _linear(exits_m, anchors_m, poses)
    variance = D[..., 3] ** 2 * (noise[0] ** 2 + noise[1] ** 2)
    variance += (by_turn**2).sum(axis=2) * noise[2] ** 2
    inverse = np.linalg.inv(np.swapaxes(D, 1, 2) @ D)
    middle = np.swapaxes(D, 1, 2) @ (D * variance[..., None])
    return np.asarray(np.sqrt(np.diagonal(inverse @ middle @ inverse, axis1=1, axis2=2)))


def predicted_errors(
    exits_m: FloatArray,
    anchors_m: FloatArray,
    poses: FloatArray,
    noise: FloatArray,
    unit: FloatArray,
) -> FloatArray:
    """Return the errors (n, 4) of one calibration by (3.63)."""
    D, by_turn = _linear(exits_m, anchors_m, poses)
    lengths, positions, turns = _of(unit, noise)
    right = (D[..., :3] * positions).sum(axis=2) + (by_turn * turns).sum(axis=2)
    right -= D[..., 3] * lengths.T
    return np.asarray((np.linalg.pinv(D) @ right[..., None])[..., 0])


def _linear(
    exits_m: FloatArray, anchors_m: FloatArray, poses: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Return D (n, N, 4), which is c and ρ for each cable and pose, and b × Q^T c (n, N, 3)."""
    arm = np.einsum("jab,ib->ija", poses[:, 1:], anchors_m)
    c = poses[:, 0] + arm - exits_m[:, None]
    D = np.concatenate([c, np.linalg.norm(c, axis=2)[..., None]], axis=2)
    return D, np.cross(anchors_m[:, None], np.einsum("jba,ijb->ija", poses[:, 1:], c))


def simulated_errors(
    exits_m: FloatArray,
    anchors_m: FloatArray,
    poses: FloatArray,
    noise: FloatArray,
    unit: FloatArray,
) -> FloatArray:
    """Return the errors (n, 4) of one calibration: exit points and lengths that minimise (3.20)."""
    rho = _linear(exits_m, anchors_m, poses)[0][..., 3].T
    lengths, positions, turns = _of(unit, noise)
    Q = poses[:, 1:] @ Rotation.from_rotvec(turns).as_matrix()
    points = (poses[:, 0] + positions)[:, None] + np.einsum("jab,ib->jia", Q, anchors_m)
    measured = rho - rho[0] + lengths
    true = np.concatenate([exits_m, rho[0][:, None]], axis=1)
    v = true
    for _ in range(_STEPS):
        c = np.swapaxes(points - v[:, :3], 0, 1)
        away = measured.T + v[:, 3:]
        u = (c**2).sum(axis=2) - away**2
        H = -2.0 * np.concatenate([c, away[..., None]], axis=2)
        gradient = np.swapaxes(H, 1, 2) @ u[..., None]
        step = np.linalg.solve(np.swapaxes(H, 1, 2) @ H, gradient)[..., 0]
        v = v - step
        if float(np.abs(step).max()) < 1e-10:
            break
    return np.asarray(v - true)


def _of(unit: FloatArray, noise: FloatArray) -> list[FloatArray]:
    """Return δΔρ (N, n), δp (N, 3) and δr (N, 3) from `unit` (N, n + 6)."""
    parts = np.split(unit, [-6, -3], axis=1)
    return [part * size for part, size in zip(parts, noise, strict=True)]


def rms_errors_m(errors_m: FloatArray) -> tuple[float, float]:
    """Return root mean squares of errors (..., n, 4): exit points, lengths, (3.39a), (3.39b)."""
    squares = errors_m**2
    return float(np.sqrt(squares[..., :3].mean())), float(np.sqrt(squares[..., 3].mean()))


def held_poses(robot: str, count: int, seed: int) -> FloatArray:
    """Return random poses (N, 4, 3) in the frame, turned by up to 30 deg, that the cables hold."""
    profile = load_robot(robot)
    if profile.platform is None or len(profile.platform.controlled) != 6:
        raise BadInputError(f"{robot}: the study needs a platform with six controlled directions")
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
    raise BadInputError(f"{robot}: its cables can hold almost no pose in its frame")


def cases() -> list[StudyCase]:
    """Return all cases of the study."""
    names = list(BOUNDS)
    biased = [
        StudyCase(f"{name} bias", f"B.{k}", BIASES[name] * share, share=share, bias=True)
        for k, name in enumerate(names, 1)
        for share in SHARES
    ]
    noisy = [
        StudyCase(name, f"B.{k}", BOUNDS[name] * share, share=share)
        for k, name in enumerate(names, 4)
        for share in SHARES
    ]
    paired = [
        StudyCase(f"{one} and {other}", figure, BOUNDS[one] * x + BOUNDS[other] * y)
        for figure, (one, other) in PAIRS.items()
        for x in PAIR_SHARES
        for y in PAIR_SHARES
    ]
    counted = [StudyCase(name, name, noise, n) for name, noise in FIGURES.items() for n in COUNTS]
    return noisy + counted + biased + paired


def study(
    robot: str, draws: int, seed: int, cluster: str | None, advance: Callable[[float], None]
) -> Rows:
    """Return a row of figures for each case, computed on all cores or a Ray cluster.

    Raises CommandError for a robot without six directions, or a cluster that fails.
    """
    every = cases()
    poses = held_poses(robot, 2 * max(COUNTS), seed)
    platform = load_robot(robot).platform
    assert platform is not None  # see `held_poses`
    geometry = np.array(platform.exit_points_m), np.array(platform.anchor_points_m)
    seeds = np.random.SeedSequence(seed).generate_state(len(every)).tolist()
    jobs = [Trials(case, *geometry, poses, draws, seeds[k]) for k, case in enumerate(every)]
    rows = []
    with runner(cores(), cluster) as run:
        for row in run(jobs):
            rows.append(row)
            advance(float(len(rows)))
    return rows


def plateaus(rows: Rows) -> Rows:
    """Return the error floor for figures 3.7 and 3.8, and the number of poses where it begins.

    Trials have e(n)^2 = s(n)^2 + f^2. The model's s(n) keeps falling as 1/sqrt(n); the floor f
    comes from the squares that (3.40) omits. f^2 is the mean of e^2 - s^2, weighted by 1/s^4. The
    plateau begins at the n where s(n) = f: from there, more poses remove at most 1 - 1/sqrt(2) of
    the error. The thesis' model is 20 % off at 100 poses and 2.8 mm. It reaches the plateau at
    100/(1.2^2 - 1) = 227 poses, and with the 3 mm of figure 3.7 at 198.
    """
    found = []
    for name in FIGURES:
        points = [row for row in rows if row["name"] == name]
        plateau: dict[str, Any] = {"figure": name}
        for key in ("exit", "offset"):
            model = np.array([row[f"predicted_{key}_mm"] for row in points]) ** 2
            trial = np.array([row[f"{key}_mm"] for row in points]) ** 2
            floor = max(float(np.average(trial - model, weights=model**-2)), 0.0)
            plateau[f"floor_{key}_mm"] = math.sqrt(floor)
            plateau[f"{key}_poses"] = (
                points[-1]["poses"] * float(model[-1]) / floor if floor else None
            )
        found.append(plateau)
    return found


def lines(rows: Rows) -> list[str]:
    """Return table 3.1 and the figures' content as lines of text."""
    shown: list[str] = []
    for title, figures in (
        ("noise at 100 poses (sigma), beside the thesis' table 3.1:", ("B.4", "B.5", "B.6")),
        ("the same bias at all 100 poses, figures B.1 to B.3:", ("B.1", "B.2", "B.3")),
        ("noise of two kinds at 100 poses, figures C.1 to C.6:", tuple(PAIRS)),
        *((f"errors by the number of poses, figure {name}:", (name,)) for name in FIGURES),
    ):
        cells = [_row(row) for row in rows if row["figure"] in figures]
        shown += [TableText([[title, "e(a) mm", "e(rho_0) mm", "ratio", "model"], *cells]), ""]
    for one in plateaus(rows):
        shown.append(
            f"figure {one['figure']}: {one['floor_exit_mm']:.2f} mm of e(a) and "
            f"{one['floor_offset_mm']:.2f} mm of e(rho_0) remain at any number of poses; noise has "
            f"the same effect at {_count(one['exit_poses'])} and {_count(one['offset_poses'])} "
            "poses"
        )
    return shown


def _row(row: dict[str, Any]) -> list[str]:
    noise = [f"{key} {row[f'{key}_mm']:.3g} mm" for key in BOUNDS if row.get(f"{key}_mm")]
    noise += [f"rotation {row['rotation_deg']:.3g} deg"] if row["rotation_deg"] else []
    counted = f"{row['poses']:6d} poses: " if row["figure"] in FIGURES else ""
    thesis = THESIS_mm.get(row["name"]) if row["share"] == 1.0 else None
    one, two = (f" ({x:g})" for x in thesis) if thesis else ("", "")
    exits, offsets = f"{row['exit_mm']:.2f}{one}", f"{row['offset_mm']:.2f}{two}"
    ratio = "" if row["ratio"] is None else f"{row['ratio']:.2f}"
    return [counted + ", ".join(noise), exits, offsets, ratio, f"{100 * row['off']:+.1f} %"]


def _count(poses: float | None) -> str:
    return "no" if poses is None else f"{poses:.0f}"


def draw(path: Path, rows: Rows) -> None:
    """Write NAME.png, NAME-B.png and NAME-C.png: the thesis' figures 3.7 and 3.8, B and C."""
    for end, figure in (("", _counted(rows)), ("-B", _compared(rows)), ("-C", _paired(rows))):
        save_figure(figure, path.with_stem(path.stem + end))


def _counted(rows: Rows) -> Figure:
    """Draw figures 3.7 and 3.8: errors by the number of poses, and their floor."""
    figure, axes = canvas(1, 2, height=3.4)
    for ax, name, plateau in zip(axes, FIGURES, plateaus(rows), strict=True):
        points = [row for row in rows if row["figure"] == name]
        _errors(ax, points, "poses")
        for key, colour, label in _ENDS:
            ax.axhline(plateau[f"floor_{key}_mm"], color=colour, ls=":",
                       label=f"{label}, floor")  # fmt: skip
        ax.set(xlabel="poses", ylabel="RMS error (mm)", title=f"as figure {name}")
    legend_above(figure, axes[0], columns=3)
    return figure


def _compared(rows: Rows) -> Figure:
    """Draw figures B.1 to B.6: errors by a bias or noise, and how far trials exceed the model."""
    figure, axes = canvas(4, 3, height=2.3)
    for k in range(6):
        name, what = list(_UNITS.values())[k % 3]
        points = [row for row in rows if row["figure"] == f"B.{k + 1}"]
        top, bottom = axes[k % 3 + 6 * (k // 3)], axes[k % 3 + 6 * (k // 3) + 3]
        _errors(top, points, name)
        for key, colour, _ in _ENDS:
            there = [row for row in points if row[f"off_{key}"] is not None]
            off = [100 * row[f"off_{key}"] for row in there]
            bottom.plot([row[name] for row in there], off, "o-", ms=3, color=colour)
        bottom.axhspan(-20, 20, color="#888888", alpha=0.12)
        kind = "bias" if k < 3 else "noise"
        bottom.set(xscale="log", xlabel=f"{kind} of {what}")
        top.set_title(f"as figure B.{k + 1}")
        if k % 3 == 0:
            top.set_ylabel("RMS error (mm)")
            bottom.set_ylabel("trial over model (%)")
    legend_above(figure, axes[2], columns=4)
    return figure


def _errors(ax: Axes, rows: Rows, by: str) -> None:
    """Draw the available errors of trials and model on logarithmic axes."""
    for key, colour, label in _ENDS:
        points = [row for row in rows if row[f"off_{key}"] is not None]
        if points:
            x = [row[by] for row in points]
            ax.plot(x, [row[f"{key}_mm"] for row in points], "o", ms=4, color=colour,
                    label=f"{label}, trial")  # fmt: skip
            ax.plot(x, [row[f"predicted_{key}_mm"] for row in points], color=colour,
                    label=f"{label}, model")  # fmt: skip
    ax.set(xscale="log", yscale="log")


def _paired(rows: Rows) -> Figure:
    """Draw figures C.1 to C.6: errors by noise of two kinds, and trials over the model in %.

    In the model the squares of errors add, and each error is proportional to its noise.
    """
    figure, axes = canvas(3, 2, height=2.7)
    for k, (title, pair) in enumerate(PAIRS.items()):
        points = [row for row in rows if row["figure"] == title]
        (x, x_label), (y, y_label) = (_UNITS[one] for one in pair)
        for ax, (key, _, label), name in zip(axes[2 * k :], _ENDS, title.split(", "), strict=False):
            units = [_at_bound(rows, one)[f"predicted_{key}_mm"] for one in pair]
            most = [_at_bound(rows, one)[at] for one, at in zip(pair, (x, y), strict=True)]
            shares = np.linspace(0.0, 1.15, 60)
            errors = np.hypot(units[0] * shares, units[1] * shares[:, None])
            drawn = ax.contourf(most[0] * shares, most[1] * shares, errors, 10, cmap="Blues")
            figure.colorbar(drawn, ax=ax, label="RMS error (mm)")
            for row in points:
                ax.text(row[x], row[y], f"{100 * row[f'off_{key}']:+.0f} %", fontsize=7,
                        ha="center", va="center",
                        bbox={"boxstyle": "round", "fc": "white", "ec": "none"})  # fmt: skip
            ax.set(xlabel=f"noise of {x_label}", ylabel=f"noise of {y_label}")
            ax.set_title(f"as figure {name}: {label}")
            ax.grid(visible=False)
    return figure


def _at_bound(rows: Rows, name: str) -> dict[str, Any]:
    """Return the row of one kind of noise alone, at the bound of table 3.1."""
    return next(row for row in rows if row["name"] == name and row["share"] == 1.0)
