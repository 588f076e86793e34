"""Where a calibration takes the platform: poses that tell most or are listed, in batches."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from cdpr_profiles import Robot
from cdpr_profiles.errors import brief
from cdpr_rt.arrays import FloatArray
from cdpr_rt.calibration.verification.held_out import LEAST_POSES
from cdpr_rt.errors import GeometryError
from cdpr_rt.motion.path.description import PathError
from cdpr_rt.robots.platform_model import PlatformModel, platform_model_of
from cdpr_rt.robots.reach.reach_kernel import CONTACT, WHOLE
from cdpr_rt.robots.reach.reachable import SHARE, Reach
from cdpr_tools.errors import BadInputError
from cdpr_tools.robots.poses.choice import KINDS, Choose, choose, read_poses

MOST_POSES = 100
"""Where nobody has said how many."""
_MOST_ASKED, _SPARE = 1000, 10
"""How many may be asked for, and further ones for those that the robot refuses."""
BATCH = 10
"""Poses after which is looked what they tell."""
_ROUNDED_rad = 1e-5
_DIGITS = 6
Listed = tuple[tuple[float, ...], ...]


@dataclass(frozen=True)
class Places:
    """Places (m, d) in the order in which they tell most, and that from which they are reached."""

    middle: FloatArray
    """(d,); the ways from here to chosen places, and back, are known to be free and held."""
    chosen: FloatArray

    def batches(self) -> Iterator[FloatArray]:
        """Yield them a batch at a time, each place of it the nearest to the one before."""
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
    """Return `count` places of a robot, reached straight from the middle of its targets.

    Raises BadInputError for a robot of which hardly a place is reached.
    """
    reach = _from_middle(robot)
    try:
        chosen = choose(reach, count, seed, by, None, SHARE)
    except GeometryError as error:
        raise BadInputError(f"{robot.path}: {error}") from None
    return Places(reach.start, chosen.positions)


def places_of(robot: Robot, count: int | None, listed: Listed | None, seed: int) -> Places:
    """Return the places that `poses_wanted` tells of: those of a list, else what tells most."""
    if listed is not None:
        return listed_places(robot, np.array(listed))
    return chosen_places(robot, (count or MOST_POSES) + _SPARE, seed)


def listed_places(robot: Robot, listed: FloatArray) -> Places:
    """Return places (m, d) that a list has named; raises BadInputError as `chosen_places` does."""
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
    """Return how many poses `--poses` asks for, home among them, and the places (m, d) it lists.

    None where it leaves that open. Raises BadInputError, PathError, ProfileError.
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
    """Return the places (m, d) of a list of poses, all of which the robot can go to."""
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
            raise PathError(path, line, "is there before; allowed: each pose once")
        seen.add(tuple(place))
    for share, why, line in zip(*reach.shares(places), read.lines, strict=True):
        if why != WHOLE:
            what = "touches something" if why == CONTACT else "cannot be held"
            middle = ", ".join(f"{x:.3f}" for x in reach.start[: reach.model.positions])
            text = f"the straight way from the middle, {middle} m, {what} after {share:.0%} of it"
            raise PathError(path, line, text)
    return places


def _why_not(model: PlatformModel, place: FloatArray, inside: bool) -> str:
    """Return why a robot cannot stand at a place (d,), empty where it can."""
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
