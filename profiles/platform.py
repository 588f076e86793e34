"""The platform of a cable robot: mass, exit and anchor points, workspace, limits."""

import math
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from importlib.metadata import entry_points
from itertools import combinations, product
from typing import Annotated, Any, Final, Literal

import numpy as np
from pydantic import AfterValidator, BeforeValidator, Field

from cdpr_profiles.errors import value_text
from cdpr_profiles.reader import Profile

FURTHEST_m = 1000.0
"""Largest allowed coordinate."""
WIDEST_m: Final = 300.0
"""Largest distance of two exit points: above that of most stadiums, below that of frames in mm."""


def _in_metres(value: float) -> float:
    if abs(value) > FURTHEST_m:
        raise ValueError(
            f"value {value:g}; allowed: -{FURTHEST_m:g} to {FURTHEST_m:g}, in metres (are "
            f"these millimetres? In metres: {0.001 * value:g})"
        )
    return value


def _direction(values: tuple[float, ...]) -> tuple[float, ...]:
    size = math.hypot(*values)
    if not size > 0.0:
        raise ValueError(f"value {list(values)}; allowed: a direction, not all 0")
    return tuple(value / size for value in values)


def _one_or_several(allowed: str) -> BeforeValidator:
    """Accept a single number as an array of one; reject matrices and texts, listing `allowed`."""

    def check(value: Any) -> Any:
        if isinstance(value, int | float) and not isinstance(value, bool):
            return (value,)
        if not isinstance(value, list | tuple) or any(isinstance(v, list | tuple) for v in value):
            raise ValueError(f"value {value_text(value)}; allowed: {allowed}")
        return value

    return BeforeValidator(check)


_Coordinate = Annotated[float, AfterValidator(_in_metres)]
Point = Annotated[tuple[_Coordinate, ...], Field(min_length=2, max_length=3)]
_PoseName = Annotated[str, Field(pattern=r"^[A-Za-z][A-Za-z0-9_-]{0,31}$")]
Direction = Annotated[
    tuple[float, ...], Field(min_length=2, max_length=3), AfterValidator(_direction)
]
"""A direction in the room; its length in the file does not matter, because it is normalised."""
_Inertia = Annotated[
    tuple[float, ...],
    _one_or_several("six numbers Ixx Iyy Izz Ixy Ixz Iyz, not a matrix; in a plane one number"),
]
_Rotation = Annotated[
    tuple[float, ...],
    _one_or_several("three numbers, a rotation vector, not a matrix; in a plane one angle"),
]
"""Rotation or angle; a single number is an array of one."""

TENSION_METHODS: Final = ("minimum-norm", "minimum-deviation", "closed-form", "polygon-centroid")
"""Built-in methods of tension distribution."""
DISTRIBUTIONS: Final = "cdpr_rt.tension_distributions"
"""Entry-point group under which installed packages register further methods by name."""
_USUAL_METHOD: Final = "minimum-deviation"
_IN_FILE: Final = re.compile(r"[^:\0]+\.py:[^\W\d]\w*")


def _known_distribution(value: str) -> str:
    """Raise ValueError if no distribution is called `value`; its code is not loaded."""
    if value in TENSION_METHODS or _IN_FILE.fullmatch(value):
        return value
    names = [point.name for point in entry_points(group=DISTRIBUTIONS)]
    if value not in names:
        allowed = ", ".join(map(repr, (*TENSION_METHODS, *names)))
        raise ValueError(f"value {value_text(value)}; allowed: {allowed} or 'FILE.py:NAME'")
    return value


CableModelName = Literal["rigid", "elastic", "catenary"]
DirectionName = Literal["x", "y", "z", "angle", "rx", "ry", "rz"]
DIRECTIONS: Final[dict[int, tuple[DirectionName, ...]]] = {
    2: ("x", "y", "angle"),
    3: ("x", "y", "z", "rx", "ry", "rz"),
}
"""Directions of a platform by its number of coordinates: positions, then angles."""
NO_PLATFORM: Final = "has no platform; allowed: a robot with a [platform]"
"""Error text for a robot without the required platform; it follows the robot's name or path."""
_LEAST_ARM_m = 0.1
_RISE_S = 0.1
"""Time in which the acceleration is reached, if the file gives no jerk."""
CLEARANCE_m: Final = 0.01
"""Default minimum distance of the centre lines of two cables; thicker cables increase it."""


class BoxFile(Profile):
    """A box given by two opposite corners, with edges along the axes of its frame."""

    min_m: Point
    max_m: Point


class PlatformFile(Profile):
    """The table [platform] of a robot's file; all points are in m.

    Two coordinates are for a vertical plane, y upward; three are for space, z upward.
    """

    mass_kg: float = Field(gt=0, le=100_000)
    home_m: Point
    """Position of the platform's origin at rest on its stand, where sessions begin and end."""
    home_tolerance_m: float = Field(default=0.05, gt=0, le=1)
    """Largest deviation of the position from `home_m`."""
    workspace_min_m: Point
    workspace_max_m: Point
    """Upper corner of the box in which targets may lie."""
    speed_m_s: float = Field(gt=0, le=20)
    acceleration_m_s2: float = Field(gt=0, le=100)
    """Acceleration limit along each direction."""
    inertia_kg_m2: _Inertia | None = None
    """Ixx Iyy Izz Ixy Ixz Iyz about the centre of mass in the platform's frame; in a plane, one."""
    centre_of_mass_m: Point | None = None
    """Centre of mass in the platform's frame; by default the origin."""
    home_rotation_rad: _Rotation | None = None
    """Rotation vector from the room's axes to the platform's at home; in a plane, an angle."""
    workspace_angle_rad: float = Field(default=0.0, ge=0)
    """Largest angle of targets from the orientation at home."""
    angular_speed_rad_s: float | None = Field(default=None, gt=0, le=100)
    angular_acceleration_rad_s2: float | None = Field(default=None, gt=0, le=10_000)
    """Acceleration limit about each axis."""
    jerk_m_s3: float | None = Field(default=None, gt=0, le=100_000)
    angular_jerk_rad_s3: float | None = Field(default=None, gt=0, le=10_000_000)
    """Jerk limit on paths; by default, the acceleration is reached in 0.1 s."""
    controlled: tuple[DirectionName, ...] | None = None
    """Directions that the cables control; by default all that they can."""
    tension_distribution: Annotated[str, AfterValidator(_known_distribution)] = _USUAL_METHOD
    """A built-in method, a name that an installed package registers, or FILE.py:NAME."""
    cable_model: CableModelName = "elastic"
    clearance_m: float | None = Field(default=None, gt=0, le=1)
    """Distance below which two cables (centre lines), or a cable and a box, count as in contact."""
    poses_m: dict[_PoseName, Point] = Field(default={}, max_length=100)
    """Named positions, the targets of `cdpr move --to NAME`."""
    body: BoxFile | None = None
    """The platform's body, in its own frame."""
    obstacles: tuple[BoxFile, ...] = Field(default=(), max_length=100)
    """Boxes of the frame and of objects around it, in the room."""


@dataclass(frozen=True)
class Platform:
    """A platform on the cables of a robot's axes; points in the order of the axes.

    Fields of `PlatformFile` have the same meaning here. `exit_points_m` are in the room,
    `anchor_points_m` are in the platform's frame, whose origin `home_m` and targets refer to.
    Missing values (empty, or 0 for an angular speed, acceleration or jerk) get defaults. With the
    default angular limits, the anchor point farthest from the origin (at least 0.1 m) moves with
    `speed_m_s` and `acceleration_m_s2`. Default jerks reach the accelerations in 0.1 s.
    """

    mass_kg: float
    home_m: tuple[float, ...]
    home_tolerance_m: float
    workspace_min_m: tuple[float, ...]
    workspace_max_m: tuple[float, ...]
    speed_m_s: float
    acceleration_m_s2: float
    exit_points_m: tuple[tuple[float, ...], ...]
    anchor_points_m: tuple[tuple[float, ...], ...]
    inertia_kg_m2: tuple[float, ...] | None = None
    centre_of_mass_m: tuple[float, ...] = ()
    home_rotation_rad: tuple[float, ...] = ()
    workspace_angle_rad: float = 0.0
    angular_speed_rad_s: float = 0.0
    angular_acceleration_rad_s2: float = 0.0
    jerk_m_s3: float = 0.0
    angular_jerk_rad_s3: float = 0.0
    controlled: tuple[str, ...] = ()
    """Controlled directions, a part of DIRECTIONS in the same order."""
    tension_distribution: str = _USUAL_METHOD
    cable_model: str = "elastic"
    clearance_m: float = CLEARANCE_m
    poses_m: Mapping[str, tuple[float, ...]] = field(default_factory=dict, hash=False)
    body: BoxFile | None = None
    obstacles: tuple[BoxFile, ...] = ()
    pulley_radius_m: tuple[float, ...] = ()
    """Radius of each axis' pulley; 0 for an eye."""
    cable_weights_N_m: tuple[float, ...] = ()
    """Cable weight per length for each axis, used in lengths and tensions; 0 neglects it."""
    pulley_axes: tuple[tuple[float, ...], ...] = ()
    """Unit vectors along which the cables arrive at their pulleys, one for each axis."""

    def __post_init__(self) -> None:
        """Fill in the defaults."""
        size, n = len(self.home_m), len(self.exit_points_m)
        up = (0.0,) * (size - 1) + (1.0,)
        arm_m = max(_LEAST_ARM_m, *(math.hypot(*anchor) for anchor in self.anchor_points_m))
        controlled = self.controlled or controlled_by_default(self.anchor_points_m)
        filled: dict[str, Any] = {
            "centre_of_mass_m": self.centre_of_mass_m or (0.0,) * size,
            "home_rotation_rad": self.home_rotation_rad or (0.0,) * (1 if size == 2 else 3),
            "controlled": tuple(name for name in DIRECTIONS[size] if name in controlled),
            "pulley_radius_m": self.pulley_radius_m or (0.0,) * n,
            "cable_weights_N_m": self.cable_weights_N_m or (0.0,) * n,
            "pulley_axes": self.pulley_axes or (up,) * n,
            "angular_speed_rad_s": self.angular_speed_rad_s or self.speed_m_s / arm_m,
            "angular_acceleration_rad_s2": (
                self.angular_acceleration_rad_s2 or self.acceleration_m_s2 / arm_m
            ),
        }
        filled["jerk_m_s3"] = self.jerk_m_s3 or self.acceleration_m_s2 / _RISE_S
        turning = filled["angular_acceleration_rad_s2"]
        filled["angular_jerk_rad_s3"] = self.angular_jerk_rad_s3 or turning / _RISE_S
        for key, value in filled.items():
            object.__setattr__(self, key, value)

    @property
    def tension_method(self) -> str:
        """The built-in method; the default one if the distribution is not built in."""
        built_in = self.tension_distribution in TENSION_METHODS
        return self.tension_distribution if built_in else _USUAL_METHOD

    @property
    def own_distribution(self) -> str:
        """The distribution that is not built in: FILE.py:NAME or a registered name; else ""."""
        own = self.tension_distribution
        return "" if own in TENSION_METHODS else own

    @property
    def is_planar(self) -> bool:
        """Whether the platform moves in a plane."""
        return len(self.home_m) == 2

    @property
    def longest_cable_m(self) -> float:
        """Longest cable with the platform at home or in its workspace, at any orientation."""
        corners = product(*zip(self.workspace_min_m, self.workspace_max_m, strict=True))
        ways = product(self.exit_points_m, (*corners, self.home_m))
        return max(math.dist(*way) for way in ways) + max(
            math.hypot(*anchor) for anchor in self.anchor_points_m
        )


def controlled_by_default(anchor_points_m: Sequence[tuple[float, ...]]) -> tuple[str, ...]:
    """Return the directions that the cables of a platform with these anchor points can control.

    They always control the positions. They also control the angles, except in two cases: all cables
    end in one point, or at most three cables hold a platform in a plane, which leave it free to
    turn.
    """
    size = len(anchor_points_m[0])
    free = len(set(anchor_points_m)) == 1 or (size == 2 and len(anchor_points_m) <= 3)
    return DIRECTIONS[size][: size if free else None]


# Faults of the table [platform] of a robot's file, as far as the file alone shows them.

_PLATFORM_FAULTS_LEAST_ARM_m = 0.01
"""Anchor points closer than this are probably the same, or in another unit."""
_OFF_BODY_m = 0.03
"""Allowed distance of anchor points from the body: more than a calibration moves them."""
_LEAST_OFF_m = 0.1
"""Allowed distance of the centre of mass from the box around the platform, however small."""
_ROUNDING = 1e-6


def platform_faults(
    file: PlatformFile | None,
    exits: Sequence[tuple[float, ...] | None],
    anchors: Sequence[tuple[float, ...] | None],
    pulley_axes: Sequence[tuple[float, ...] | None],
) -> Iterator[tuple[str, str]]:
    """Yield (key, problem) for implausible values in [platform] and its points on the axes."""
    if file is None:
        for i, points in enumerate(zip(exits, anchors, strict=True)):
            if points != (None, None):
                yield f"axes[{i}]", "exit_point_m, anchor_point_m: allowed only with [platform]"
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
    """Yield keys with the wrong number of values for a plane or space."""
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
    """Yield points, rotations and inertias of an implausible size, as if in another unit."""
    frame_m, platform_m = _widest(exits), _widest(anchors)
    if frame_m > WIDEST_m:
        problem = (
            f"exit points are up to {frame_m:g} m apart; allowed: up to {WIDEST_m:g} m "
            "(are they in millimetres?)"
        )
        yield "axes[0].exit_point_m", problem
    if 0.0 < platform_m < _PLATFORM_FAULTS_LEAST_ARM_m:
        problem = (
            f"anchor points are {platform_m:g} m apart at most; allowed: all equal, or at "
            f"least {_PLATFORM_FAULTS_LEAST_ARM_m:g} m apart (are the units right?)"
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
    """Yield anchor points off the body, and a centre of mass far off the platform.

    Without a body, the platform is the box around its anchor points. If all anchor points are
    equal, nothing is checked.
    """
    size, body, points = len(file.home_m), file.body, list(anchors)
    if body is not None and len(body.min_m) == len(body.max_m) == size:
        beside_m = [_beside_m(anchor, body.min_m, body.max_m) for anchor in anchors]
        i = beside_m.index(max(beside_m))
        if beside_m[i] > _OFF_BODY_m:
            problem = (
                f"value {list(anchors[i])}; {beside_m[i]:.3g} m outside platform.body; allowed: on "
                f"it, or up to {_OFF_BODY_m:g} m from it (does the body include all anchor points?)"
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
            f"value {list(centre)}; {off_m:.3g} m outside the box around {what}; allowed: in it, "
            f"or up to {allowed_m:.3g} m from it (platform.body gives the extent of the platform)"
        )
        yield "platform.centre_of_mass_m", problem


def _beside_m(point: tuple[float, ...], low: tuple[float, ...], high: tuple[float, ...]) -> float:
    """Return the distance of a point from a box, 0 inside."""
    sides = zip(point, low, high, strict=True)
    return math.hypot(*(max(a - value, value - b, 0.0) for value, a, b in sides))


def _widest(points: Sequence[tuple[float, ...]]) -> float:
    return max((math.dist(a, b) for a, b in combinations(points, 2)), default=0.0)


def _inertia_faults(
    given: tuple[float, ...], mass_kg: float, frame_m: float
) -> Iterator[tuple[str, str]]:
    """Yield faults of an inertia that is impossible for any body, or too large for the frame."""
    key = "platform.inertia_kg_m2"
    moments = np.array(given)
    if len(given) == 6:
        xx, yy, zz, xy, xz, yz = given
        moments = np.linalg.eigvalsh([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
    shown = ", ".join(f"{moment:.4g}" for moment in moments)
    if not moments.min() > 0.0:
        yield key, f"principal moments {shown}; allowed: all above 0"
    elif len(moments) == 3 and moments[2] > (1.0 + _ROUNDING) * (moments[0] + moments[1]):
        problem = f"principal moments {shown}; allowed: none larger than the sum of the other two"
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
    """Yield faults of the controlled directions: not controllable by the cables, or no values."""
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
        problem = f"{n}; allowed: {len(controlled)} or more to control {', '.join(given)}"
        if size == 3 and len(controlled) == 6:
            problem += ", or all anchor points equal: a point in space needs 3"
        yield "axes", problem
    if len(set(anchors)) == 1 and len(controlled) > size:
        problem = f"value {list(controlled)}; allowed: no angle if all anchor points are equal"
        yield "platform.controlled", problem
    if file.workspace_angle_rad > 0.0:
        if len(controlled) == size:
            problem = f"value {file.workspace_angle_rad:g}; allowed: 0 if no angle is controlled"
            yield "platform.workspace_angle_rad", problem
        else:
            for key in ("angular_speed_rad_s", "angular_acceleration_rad_s2"):
                if getattr(file, key) is None:
                    allowed = "required if workspace_angle_rad is above 0"
                    yield f"platform.{key}", f"missing; {allowed}"
    if file.tension_distribution == "polygon-centroid" and n > len(controlled) + 2:
        problem = (
            f"value {file.tension_distribution!r}; allowed for up to {len(controlled) + 2} "
            f"cables with {len(controlled)} controlled directions, not {n}"
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
    for name, point in file.poses_m.items():
        yield from _pose_faults(file, name, point)


def _pose_faults(
    file: PlatformFile, name: str, point: tuple[float, ...]
) -> Iterator[tuple[str, str]]:
    """Yield faults of a named pose, which must be in the box of targets."""
    key = f"platform.poses_m.{name}"
    if name == "home":
        yield key, "the name stands for home_m; allowed: another name"
    if len(point) != len(file.home_m):
        yield key, _of_another_length(point, f"{len(file.home_m)} coordinates, as home_m has")
        return
    box = zip(file.workspace_min_m, point, file.workspace_max_m, strict=True)
    for i, (low, value, high) in enumerate(box):
        if not low <= value <= high:
            yield f"{key}[{i}]", f"value {value:g}; allowed: {low:g} to {high:g}"
