"""Choose reachable poses, and read and write them: as CSV, or as TOML like a path."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from enum import StrEnum
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import Normalize
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle
from matplotlib.ticker import MaxNLocator

from cdpr_profiles.bounded_input import may_replace, read_text
from cdpr_rt.arrays import FloatArray
from cdpr_rt.calibration.pose_choice import (
    cable_geometry,
    informative,
    predicted_deviation_m,
    spread,
)
from cdpr_rt.model.platform_model import PlatformModel
from cdpr_rt.model.reachable import Reach, Reached
from cdpr_rt.motion.path_description import Coordinates, PathDescription
from cdpr_rt.motion.way_points import MOST_BYTES, read_csv_points, read_toml_points
from cdpr_tools import style
from cdpr_tools.errors import BadInputError, os_error_as

AMONG = 20
"""Number of random poses for each chosen pose."""


class Choose(StrEnum):
    """Criterion by which poses are chosen."""

    RANDOM = "random"
    SPREAD = "spread"
    INFORMATION = "information"


@dataclass(frozen=True)
class Chosen:
    """Chosen positions (m, d) in their order, and the poses from which they were chosen."""

    positions: FloatArray
    shares: FloatArray
    drawn: Reached
    clearance_m: float
    margin_N: float
    deviation_m: float | None
    """Deviation of exit points after a calibration with these poses; None in a plane."""


def choose(
    reach: Reach, count: int, seed: int, by: Choose, angle_rad: float | None, share: float
) -> Chosen:
    """Return `count` reachable poses, chosen from many more unless the choice is random."""
    model = reach.model
    among = count if by is Choose.RANDOM else AMONG * count
    drawn = reach.draw(among, seed, angle_rad, share)
    taken = np.arange(count)
    if by is Choose.SPREAD:
        taken = spread(drawn.positions, model.wrench_scale, count)
    elif by is Choose.INFORMATION:
        taken = informative(cable_geometry(model), model.poses(drawn.positions), count)
    positions = drawn.positions[taken]
    poses = model.poses(positions)
    clearances, _ = model.interference.clearances(poses)
    return Chosen(
        positions,
        drawn.shares[taken],
        drawn,
        float(clearances.min()),
        float(model.workspace().capacity_margins(poses).min()),
        predicted_deviation_m(model.kinematics.geometry, poses) if model.positions == 3 else None,
    )


KINDS = (".csv", ".toml")


def checked_file(path: Path) -> Path:
    """Return the path if a list of poses can be written there; raises BadInputError."""
    if path.suffix not in KINDS or not path.parent.is_dir():
        raise BadInputError(f"{path}: allowed: NAME.csv or NAME.toml in an existing folder")
    if not may_replace(path):
        raise BadInputError(f"--out {path}: already exists; choose another name")
    return path


def write_poses(path: Path, positions: FloatArray, names: Sequence[str], lengths: int) -> None:
    """Write positions (m, d) in the directions `names`, the first `lengths` of them in m.

    Raises BadInputError if the file cannot be written.
    """
    if path.suffix == ".csv":
        lines = [",".join(_columns(names, lengths))]
        lines += [",".join(f"{x:.6f}" for x in position) for position in positions]
    else:
        lines = []
        for position in positions:
            lines += ["[[points]]", f"position_m = [{_listed(position[:lengths])}]"]
            if len(position) > lengths:
                lines.append(f"rotation_rad = [{_listed(position[lengths:])}]")
            lines.append("")
    with os_error_as(BadInputError, str(path)):
        path.write_text("\n".join(lines) + "\n", encoding="utf-8")


def read_poses(path: Path, model: PlatformModel) -> PathDescription:
    """Return the positions (m, d) of a list written by `write_poses`, each with its line.

    Raises BadInputError, PathError, ProfileError.
    """
    if path.suffix not in KINDS:
        raise BadInputError(f"{path}: allowed: NAME.csv or NAME.toml, as `cdpr poses` writes them")
    coordinates = Coordinates(model.platform.controlled, model.home)
    if path.suffix == ".toml":
        return read_toml_points(path, coordinates)
    text = read_text(path, MOST_BYTES)
    return read_csv_points(text, str(path), coordinates, all_columns=True)


def _columns(names: Sequence[str], lengths: int) -> list[str]:
    units = ["m"] * lengths + ["rad"] * (len(names) - lengths)
    return [f"{name}_{unit}" for name, unit in zip(names, units, strict=True)]


def _listed(values: FloatArray) -> str:
    return ", ".join(f"{x:.6f}" for x in values)


# The picture of a list of poses: their positions, their angles, and the ways to them.

_WAY, _START, _OBSTACLE = "#999999", "#d1581a", "#cccccc"


def draw_poses(title: str, reach: Reach, chosen: Chosen, path: Path) -> None:
    """Write the picture as PNG."""
    model = reach.model
    k, turned = model.positions, model.size > model.positions
    views = [(0, 1)] if k == 2 else [(0, 2), (1, 2), (0, 1)]
    figure = Figure(figsize=(3.9 * len(views) + 1.2, 4.2), layout="constrained")
    box = np.subtract(model.platform.workspace_max_m, model.platform.workspace_min_m)
    widths = [float(box[i]) for i, _ in views]  # about the same scale for all views
    all_axes = figure.subplots(1, len(views), squeeze=False, width_ratios=widths)[0]
    angle = np.degrees(np.linalg.norm(chosen.positions[:, k:], axis=1))
    for ax, view in zip(all_axes, views, strict=True):
        _draw_view(ax, reach, chosen, angle if turned else None, view)
    if turned:
        shades = all_axes[-1].collections[-1]
        style.colour_bar(figure, shades, all_axes, "turned from home's orientation (deg)")
    figure.suptitle(title)
    style.legend_below(figure, all_axes[0], columns=4)
    style.save_figure(figure, path)


def _draw_view(
    ax: Axes, reach: Reach, chosen: Chosen, angle_deg: FloatArray | None, view: tuple[int, int]
) -> None:
    i, j = view
    platform, start = reach.model.platform, reach.start
    for position in chosen.positions:
        ax.plot([start[i], position[i]], [start[j], position[j]], "-", color=_WAY, lw=0.4, zorder=1)
    style.box_of_targets(ax, platform.workspace_min_m, platform.workspace_max_m, view)
    ax.plot(start[i], start[j], "s", color=_START, ms=7, zorder=4, label="start")
    for box in platform.obstacles:
        size = np.subtract(box.max_m, box.min_m)
        corner = (box.min_m[i], box.min_m[j])
        ax.add_patch(Rectangle(corner, float(size[i]), float(size[j]), fc=_OBSTACLE, ec=_WAY))
    x, y = chosen.positions[:, i], chosen.positions[:, j]
    if angle_deg is None:
        ax.scatter(x, y, s=16, color=style.SERIES[0], zorder=3, label="pose")
    else:
        shown = Normalize(0.0, max(float(angle_deg.max()), math.degrees(1e-3)))
        ax.scatter(x, y, s=16, c=angle_deg, cmap="viridis", norm=shown, zorder=3, label="pose")
    style.label_view(ax, view)
    ax.xaxis.set_major_locator(MaxNLocator(6))
