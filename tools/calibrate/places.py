"""The poses of a calibration, in batches: the most informative ones, or those of a list."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from cdpr_profiles import Robot
from cdpr_profiles.errors import brief
from cdpr_rt.arrays import FloatArray
from cdpr_rt.calibration.verification import LEAST_POSES
from cdpr_rt.errors import GeometryError
from cdpr_rt.model.platform_model import PlatformModel, platform_model_of
from cdpr_rt.model.reachable import CONTACT, SHARE, WHOLE, Reach
from cdpr_rt.motion.path_description import PathError
from cdpr_tools.errors import BadInputError
from cdpr_tools.robots.pose_choice import KINDS, Choose, choose, read_poses

MOST_POSES = 100
"""Largest number of poses, if the user gives none."""
_MOST_ASKED, _SPARE = 1000, 10
"""Largest number that a user may ask for, and spare poses for those that the robot refuses."""
BATCH = 10
"""Poses between two evaluations of the data."""
_ROUNDED_rad = 1e-5
_DIGITS = 6
Listed = tuple[tuple[float, ...], ...]


@dataclass(frozen=True)
class Places:
    """Places (m, d), the most informative first, and the place from which they are reached."""

    middle: FloatArray
    """Place (d,); between it and the chosen places, there is no contact and the cables can hold the
    platform."""
    chosen: FloatArray

    def batches(self) -> Iterator[FloatArray]:
        """Yield the places in batches; in a batch each place is the nearest to the previous one."""
        last = self.middle
        scale = np.ptp(self.chosen, axis=0) + 1e-9
        for first in range(0, len(self.chosen), BATCH):
            left = list(self.chosen[first : first + BATCH])
            batch = []
            while left:
                far = [float(np.linalg.norm((place - last) / scale)) for place in left]
                last = left.pop(int(np.argmin(far)))
                batch.append(last)
            yield np.array(batch)


def chosen_places(robot: Robot, count: int, seed: int, by: Choose = Choose.INFORMATION) -> Places:
    """Return `count` places that the robot reaches straight from the middle of its workspace.

    Raises BadInputError if the robot reaches hardly any place.
    """
    reach = _from_middle(robot)
    try:
        chosen = choose(reach, count, seed, by, None, SHARE)
    except GeometryError as error:
        raise BadInputError(f"{robot.path}: {error}") from None
    return Places(reach.start, chosen.positions)


def places_of(robot: Robot, count: int | None, listed: Listed | None, seed: int) -> Places:
    """Return the places for a result of `poses_wanted`: the listed or the most informative ones."""
    if listed is not None:
        return listed_places(robot, np.array(listed))
    return chosen_places(robot, (count or MOST_POSES) + _SPARE, seed)


def listed_places(robot: Robot, listed: FloatArray) -> Places:
    """Return the places (m, d) of a list; raises BadInputError as `chosen_places` does."""
    return Places(_from_middle(robot).start, listed)


def _from_middle(robot: Robot) -> Reach:
    model = platform_model_of(robot)
    platform, k = model.platform, model.positions
    middle = np.array(model.home, float)
    middle[:k] = (np.array(platform.workspace_min_m) + np.array(platform.workspace_max_m)) / 2.0
    middle[k:] = 0.0
    try:
        return Reach(model, middle)
    except GeometryError as error:
        raise BadInputError(f"{robot.path}: {error}") from None


def poses_wanted(robot: Robot, text: str | None) -> tuple[int | None, Listed | None]:
    """Return the number of poses that `--poses` gives, with home, and the places (m, d) it lists.

    Both are None if not given. Raises BadInputError, PathError, ProfileError.
    """
    if text is None:
        return None, None
    allowed = f"allowed: {LEAST_POSES} to {_MOST_ASKED}, or NAME.csv or NAME.toml with a list"
    if text.removeprefix("-").isdecimal():
        if len(text) > _DIGITS or not LEAST_POSES <= int(text) <= _MOST_ASKED:
            raise BadInputError(f"--poses {brief(text)}: {allowed}")
        return int(text), None
    if Path(text).suffix not in KINDS:
        raise BadInputError(f"--poses {brief(text)}: {allowed}")
    listed = _listed(robot, Path(text))
    return 1 + len(listed), tuple(tuple(place) for place in listed.tolist())


def _listed(robot: Robot, path: Path) -> FloatArray:
    """Return the places (m, d) of a list of poses; raises PathError if one is not reachable."""
    reach = _from_middle(robot)
    read = read_poses(path, reach.model)
    places = read.points
    if not LEAST_POSES - 1 <= len(places) < _MOST_ASKED:
        allowed = f"{LEAST_POSES - 1} to {_MOST_ASKED - 1}, home is read besides"
        raise BadInputError(f"--poses {path}: {len(places)} poses; allowed: {allowed}")
    seen: set[tuple[float, ...]] = set()
    for place, line, inside in zip(places, read.lines, reach.are_targets(places), strict=True):
        if why_not := _why_not(reach.model, place, bool(inside)):
            raise PathError(path, line, why_not)
        if tuple(place) in seen:
            raise PathError(path, line, "occurs twice; list each pose once")
        seen.add(tuple(place))
    for share, why, line in zip(*reach.shares(places), read.lines, strict=True):
        if why != WHOLE:
            what = "touches something" if why == CONTACT else "cannot be held"
            middle = ", ".join(f"{x:.3f}" for x in reach.start[: reach.model.positions])
            text = f"the straight line from the middle, {middle} m, {what} after {share:.0%} of it"
            raise PathError(path, line, text)
    return places


def _why_not(model: PlatformModel, place: FloatArray, inside: bool) -> str:
    """Return why a robot cannot stand at a place (d,), empty if it can."""
    k, platform = model.positions, model.platform
    at = f"pose at {', '.join(f'{x:.6g}' for x in place[:k])} m"
    if not inside:
        low, high = list(platform.workspace_min_m), list(platform.workspace_max_m)
        return f"{at}: outside the workspace; allowed: {low} to {high}, above its stand"
    if (angle := float(np.linalg.norm(place[k:]))) > model.angle_rad + _ROUNDED_rad:
        most = f"{math.degrees(model.angle_rad):.1f} deg (workspace_angle_rad)"
        return f"{at}: turned by {math.degrees(angle):.1f} deg; allowed: up to {most}"
    pose = model.pose(place)
    why_not = model.workspace().infeasibility(pose) or model.interference.contact(pose.array)
    return f"{at}: {why_not}" if why_not else ""
