"""Poses that are reached, which are chosen, and a file of them: CSV, or TOML as a path's is."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from enum import StrEnum
from pathlib import Path

import numpy as np

from cdpr_profiles.reading.bounded_input import read_text
from cdpr_rt.arrays import FloatArray
from cdpr_rt.calibration.pose_choice import (
    cable_geometry,
    informative,
    predicted_deviation_m,
    spread,
)
from cdpr_rt.motion.path.description import Coordinates, PathDescription
from cdpr_rt.motion.path.reading import MOST_BYTES
from cdpr_rt.motion.path.way_points import read_csv_points, read_toml_points
from cdpr_rt.robots.platform_model import PlatformModel
from cdpr_rt.robots.reach.reachable import Reach, Reached
from cdpr_tools.errors import BadInputError, os_error_as

AMONG = 20
"""Times as many poses are drawn as are chosen among them."""


class Choose(StrEnum):
    """By what poses are chosen."""

    RANDOM = "random"
    SPREAD = "spread"
    INFORMATION = "information"


@dataclass(frozen=True)
class Chosen:
    """Positions (m, d) in the order they were chosen in, and what they were drawn from."""

    positions: FloatArray
    shares: FloatArray
    drawn: Reached
    clearance_m: float
    margin_N: float
    deviation_m: float | None
    """Of exit points after a calibration with these poses, where there are three directions."""


def choose(
    reach: Reach, count: int, seed: int, by: Choose, angle_rad: float | None, share: float
) -> Chosen:
    """Return `count` poses that are reached, chosen among many more unless at random."""
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
    """Return a path that can be written as a list of poses; raises BadInputError."""
    if path.suffix not in KINDS or not path.parent.is_dir():
        raise BadInputError(f"{path}: allowed: NAME.csv or NAME.toml in a folder that is there")
    return path


def write_poses(path: Path, positions: FloatArray, names: Sequence[str], lengths: int) -> None:
    """Write positions (m, d), of whose directions, called `names`, the first are `lengths`.

    Raises BadInputError where it cannot be written.
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
    """Return the positions (m, d) of a list of poses, each with its line; as `write_poses` has it.

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
