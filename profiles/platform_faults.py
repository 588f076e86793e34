"""What is wrong with the table [platform] of a robot's file, as far as the file alone tells."""

import math
from collections.abc import Iterator, Sequence
from itertools import combinations

import numpy as np

from cdpr_profiles.errors import value_text
from cdpr_profiles.platform import DIRECTIONS, PlatformFile, WIDEST_m, controlled_by_default

_LEAST_ARM_m = 0.01
"""Anchor points nearer together than this are meant to be one, or are in another unit."""
_OFF_BODY_m = 0.03
"""More than a calibration moves an anchor point that is on the platform's body."""
_LEAST_OFF_m = 0.1
"""By which the centre of mass may be off the box around even the smallest platform."""
_ROUNDING = 1e-6


def platform_faults(
    file: PlatformFile | None,
    exits: Sequence[tuple[float, ...] | None],
    anchors: Sequence[tuple[float, ...] | None],
    pulley_axes: Sequence[tuple[float, ...] | None],
) -> Iterator[tuple[str, str]]:
    """Yield (key, problem) for what cannot be meant in [platform] and its points on the axes."""
    if file is None:
        for i, points in enumerate(zip(exits, anchors, strict=True)):
            if points != (None, None):
                yield f"axes[{i}]", "exit_point_m, anchor_point_m: allowed: along with [platform]"
        return
    size = len(file.home_m)
    found = False
    for name, points_m in (
        ("exit_point_m", exits),
        ("anchor_point_m", anchors),
        ("pulley_axis", pulley_axes),
    ):
        for i, given in enumerate(points_m):
            if given is None and name != "pulley_axis":
                found = True
                yield f"axes[{i}].{name}", "missing; allowed: one for each axis of a platform"
            elif given is not None and len(given) != size:
                found = True
                problem = _of_another_length(given, f"{size} coordinates, as platform.home_m has")
                yield f"axes[{i}].{name}", problem
    yield from _box_faults(file)
    yield from _body_faults(file, size)
    yield from _count_faults(file, size)
    if not found:
        yield from _direction_faults(file, [anchor or () for anchor in anchors])
        yield from _size_faults(file, [p or () for p in exits], [p or () for p in anchors])
        yield from _reach_faults(file, [p or () for p in anchors])


def _count_faults(file: PlatformFile, size: int) -> Iterator[tuple[str, str]]:
    """Yield keys with another count of numbers than a plane's or a space's."""
    angles, inertia = (1, 1) if size == 2 else (3, 6)
    for key, allowed in (
        ("inertia_kg_m2", inertia),
        ("centre_of_mass_m", size),
        ("home_rotation_rad", angles),
    ):
        given = getattr(file, key)
        if given is not None and len(given) != allowed:
            where = "a plane" if size == 2 else "space"
            many = "1 number" if allowed == 1 else f"{allowed} numbers"
            yield f"platform.{key}", _of_another_length(given, f"{many} in {where}")


def _of_another_length(given: Sequence[float], allowed: str) -> str:
    return f"value {value_text(given)}; allowed: {allowed}"


def _body_faults(file: PlatformFile, size: int) -> Iterator[tuple[str, str]]:
    """Yield faults of the boxes of platform and room."""
    boxes = [] if file.body is None else [("platform.body", file.body)]
    boxes += [(f"platform.obstacles[{i}]", box) for i, box in enumerate(file.obstacles)]
    for key, box in boxes:
        for name, point in (("min_m", box.min_m), ("max_m", box.max_m)):
            if len(point) != size:
                allowed = f"{size} coordinates, as platform.home_m has"
                yield f"{key}.{name}", _of_another_length(point, allowed)
                return
        for i, (low, high) in enumerate(zip(box.min_m, box.max_m, strict=True)):
            if not low < high:
                yield f"{key}.max_m[{i}]", f"value {high:g}; allowed: above {low:g}"


def _size_faults(
    file: PlatformFile,
    exits: Sequence[tuple[float, ...]],
    anchors: Sequence[tuple[float, ...]],
) -> Iterator[tuple[str, str]]:
    """Yield points, rotations and inertias of a size that no robot has, as in another unit."""
    frame_m, platform_m = _widest(exits), _widest(anchors)
    if frame_m > WIDEST_m:
        problem = (
            f"exit points are up to {frame_m:g} m apart; allowed: up to {WIDEST_m:g} m "
            "(are they in millimetres?)"
        )
        yield "axes[0].exit_point_m", problem
    if 0.0 < platform_m < _LEAST_ARM_m:
        problem = (
            f"anchor points are {platform_m:g} m apart at most; allowed: all alike, or "
            f"{_LEAST_ARM_m:g} m and more (which unit are they in?)"
        )
        yield "axes[0].anchor_point_m", problem
    if file.centre_of_mass_m is not None and math.hypot(*file.centre_of_mass_m) > frame_m:
        problem = (
            f"{math.hypot(*file.centre_of_mass_m):g} m off the origin; allowed: on the platform, "
            f"not beyond the frame, whose exit points are {frame_m:g} m apart"
        )
        yield "platform.centre_of_mass_m", problem
    if file.home_rotation_rad is not None and math.hypot(*file.home_rotation_rad) > math.pi:
        size = math.hypot(*file.home_rotation_rad)
        problem = f"{size:.4g} rad long; allowed: up to pi (is it in degrees?)"
        yield "platform.home_rotation_rad", problem
    if file.workspace_angle_rad >= math.pi:
        problem = f"value {file.workspace_angle_rad:g}; allowed: below pi (is it in degrees?)"
        yield "platform.workspace_angle_rad", problem
    if file.inertia_kg_m2 is not None and len(file.inertia_kg_m2) in (1, 6):
        yield from _inertia_faults(file.inertia_kg_m2, file.mass_kg, frame_m)


def _reach_faults(
    file: PlatformFile, anchors: Sequence[tuple[float, ...]]
) -> Iterator[tuple[str, str]]:
    """Yield anchor points beside the body, and a centre of mass far beside the platform.

    Without a body, the platform is the box around its anchor points; a point has no such box.
    """
    size, body, points = len(file.home_m), file.body, list(anchors)
    if body is not None and len(body.min_m) == len(body.max_m) == size:
        beside_m = [_beside_m(anchor, body.min_m, body.max_m) for anchor in anchors]
        i = beside_m.index(max(beside_m))
        if beside_m[i] > _OFF_BODY_m:
            problem = (
                f"value {list(anchors[i])}; {beside_m[i]:.3g} m beside platform.body; allowed: on "
                f"it, or up to {_OFF_BODY_m:g} m beside it (does the body reach to all of them?)"
            )
            yield f"axes[{i}].anchor_point_m", problem
        points += [body.min_m, body.max_m]
    centre = file.centre_of_mass_m
    low, high = (tuple(map(extreme, zip(*points, strict=True))) for extreme in (min, max))
    if centre is None or len(centre) != size or low == high:
        return
    allowed_m = max(_LEAST_OFF_m, 0.5 * math.dist(low, high))
    off_m = _beside_m(centre, low, high)
    if off_m > allowed_m:
        what = "anchor points" if body is None else "anchor points and body"
        problem = (
            f"value {list(centre)}; {off_m:.3g} m beside the box around {what}; allowed: in it, or "
            f"up to {allowed_m:.3g} m beside it (platform.body says how far the platform reaches)"
        )
        yield "platform.centre_of_mass_m", problem


def _beside_m(point: tuple[float, ...], low: tuple[float, ...], high: tuple[float, ...]) -> float:
    """Return how far a point is off a box, 0 in it."""
    sides = zip(point, low, high, strict=True)
    return math.hypot(*(max(a - value, value - b, 0.0) for value, a, b in sides))


def _widest(points: Sequence[tuple[float, ...]]) -> float:
    return max((math.dist(a, b) for a, b in combinations(points, 2)), default=0.0)


def _inertia_faults(
    given: tuple[float, ...], mass_kg: float, frame_m: float
) -> Iterator[tuple[str, str]]:
    """Yield faults of an inertia: no body has it, or none as small as its frame."""
    key = "platform.inertia_kg_m2"
    moments = np.array(given)
    if len(given) == 6:
        xx, yy, zz, xy, xz, yz = given
        moments = np.linalg.eigvalsh([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
    shown = ", ".join(f"{moment:.4g}" for moment in moments)
    if not moments.min() > 0.0:
        yield key, f"principal moments {shown}; allowed: all above 0"
    elif len(moments) == 3 and moments[2] > (1.0 + _ROUNDING) * (moments[0] + moments[1]):
        problem = f"principal moments {shown}; allowed: none above the sum of the two others"
        yield key, problem
    elif math.sqrt(moments.max() / mass_kg) > 0.5 * frame_m:
        problem = (
            f"with {mass_kg:g} kg a radius of gyration of {math.sqrt(moments.max() / mass_kg):.3g} "
            f"m; allowed: up to half the {frame_m:.3g} m between exit points (is it in kg m2?)"
        )
        yield key, problem


def _direction_faults(
    file: PlatformFile, anchors: Sequence[tuple[float, ...]]
) -> Iterator[tuple[str, str]]:
    """Yield faults of controlled directions, against the cables and what angles need."""
    size, n = len(file.home_m), len(anchors)
    known = DIRECTIONS[size]
    given = controlled_by_default(anchors) if file.controlled is None else file.controlled
    controlled = set(given)
    twice = len(controlled) < len(given)
    if twice or controlled - set(known) or not set(known[:size]) <= controlled:
        positions, angles = ", ".join(known[:size]), ", ".join(known[size:])
        problem = f"value {list(given)}; allowed: {positions}, and any of {angles}, each once"
        yield "platform.controlled", problem
        return
    if len(controlled) > n:
        problem = f"{n}; allowed: {len(controlled)} and more to control {', '.join(given)}"
        if size == 3 and len(controlled) == 6:
            problem += ", or all anchor points alike: a point in space takes 3"
        yield "axes", problem
    if len(set(anchors)) == 1 and len(controlled) > size:
        problem = f"value {list(controlled)}; allowed: no angle where all anchor points are alike"
        yield "platform.controlled", problem
    if file.workspace_angle_rad > 0.0:
        if len(controlled) == size:
            problem = f"value {file.workspace_angle_rad:g}; allowed: 0 where no angle is controlled"
            yield "platform.workspace_angle_rad", problem
        else:
            for key in ("angular_speed_rad_s", "angular_acceleration_rad_s2"):
                if getattr(file, key) is None:
                    allowed = "allowed: given where workspace_angle_rad is above 0"
                    yield f"platform.{key}", f"missing; {allowed}"
    if file.tension_distribution.startswith("polygon") and n > len(controlled) + 2:
        problem = (
            f"value {file.tension_distribution!r}; allowed: for up to {len(controlled) + 2} cables "
            f"where {len(controlled)} directions are controlled, not {n}"
        )
        yield "platform.tension_distribution", problem


def _box_faults(file: PlatformFile) -> Iterator[tuple[str, str]]:
    """Yield faults of the workspace; home may be below it, not beside or above it."""
    size = len(file.home_m)
    for key in ("workspace_min_m", "workspace_max_m"):
        point = getattr(file, key)
        if len(point) != size:
            allowed = f"{size} coordinates, as home_m has"
            yield f"platform.{key}", _of_another_length(point, allowed)
            return
    box = zip(file.workspace_min_m, file.home_m, file.workspace_max_m, strict=True)
    for i, (low, home, high) in enumerate(box):
        if not low < high:
            yield f"platform.workspace_max_m[{i}]", f"value {high:g}; allowed: above {low:g}"
        elif i == size - 1 and home > high:
            problem = f"value {home:g}; allowed: up to {high:g} (the last coordinate is upward)"
            yield f"platform.home_m[{i}]", problem
        elif i < size - 1 and not low <= home <= high:
            yield f"platform.home_m[{i}]", f"value {home:g}; allowed: {low:g} to {high:g}"
