"""The platform of a cable robot: mass, exit and anchor points, workspace, limits."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import product
from typing import Annotated, Any, Final, Literal, get_args

from pydantic import AfterValidator, BeforeValidator, Field

from cdpr_profiles.errors import value_text
from cdpr_profiles.reading.reader import Profile

FURTHEST_m = 1000.0
"""Largest coordinate that is allowed."""
WIDEST_m: Final = 300.0
"""Largest distance of two exit points; most stadiums are less wide, most frames in mm are more."""


def _in_metres(value: float) -> float:
    if abs(value) > FURTHEST_m:
        raise ValueError(
            f"value {value:g}; allowed: -{FURTHEST_m:g} to {FURTHEST_m:g}, in metres (were "
            f"millimetres written? In metres: {0.001 * value:g})"
        )
    return value


def _direction(values: tuple[float, ...]) -> tuple[float, ...]:
    size = math.hypot(*values)
    if not size > 0.0:
        raise ValueError(f"value {list(values)}; allowed: a direction, not all 0")
    return tuple(value / size for value in values)


def _one_or_several(allowed: str) -> BeforeValidator:
    """Take a single number as an array of one, and refuse matrices and texts by what is allowed."""

    def check(value: Any) -> Any:
        if isinstance(value, int | float) and not isinstance(value, bool):
            return (value,)
        if not isinstance(value, list | tuple) or any(isinstance(v, list | tuple) for v in value):
            raise ValueError(f"value {value_text(value)}; allowed: {allowed}")
        return value

    return BeforeValidator(check)


_Coordinate = Annotated[float, AfterValidator(_in_metres)]
Point = Annotated[tuple[_Coordinate, ...], Field(min_length=2, max_length=3)]
Direction = Annotated[
    tuple[float, ...], Field(min_length=2, max_length=3), AfterValidator(_direction)
]
"""A direction in the room; its length does not matter, and is 1 once read."""
_Inertia = Annotated[
    tuple[float, ...],
    _one_or_several("six numbers Ixx Iyy Izz Ixy Ixz Iyz, not a matrix; in a plane one number"),
]
_Rotation = Annotated[
    tuple[float, ...],
    _one_or_several("three numbers, a rotation vector, not a matrix; in a plane one angle"),
]
"""A single number is an array of one."""

TensionMethod = Literal[
    "minimum-norm", "minimum-deviation", "closed-form",
    "polygon-1-norm", "polygon-2-norm", "polygon-centroid",
]  # fmt: skip
TENSION_METHODS: Final[tuple[str, ...]] = get_args(TensionMethod)
"""Methods of tension distribution."""
CableModelName = Literal["rigid", "elastic", "catenary"]
DirectionName = Literal["x", "y", "z", "angle", "rx", "ry", "rz"]
DIRECTIONS: Final[dict[int, tuple[DirectionName, ...]]] = {
    2: ("x", "y", "angle"),
    3: ("x", "y", "z", "rx", "ry", "rz"),
}
"""Directions of a platform by how many coordinates it has: positions, then angles."""
NO_PLATFORM: Final = "has no platform; allowed: robots with a [platform]"
"""Said, after its name or path, of a robot that is asked for what only a platform has."""
_LEAST_ARM_m = 0.1
_RISE_S = 0.1
"""In which the acceleration is reached where no jerk is given."""
CLEARANCE_m: Final = 0.01
"""Between centre lines of cables, where a robot's file says no other and none is thicker."""


class BoxFile(Profile):
    """A box by two opposite corners; edges along the axes of the frame that it is given in."""

    min_m: Point
    max_m: Point


class PlatformFile(Profile):
    """The table [platform] of a robot's file; two coordinates are a vertical plane, y upward.

    All points are in m. Three coordinates are a room, z upward.
    """

    mass_kg: float = Field(gt=0, le=10_000)
    home_m: Point
    """Position of its origin at rest on its stand, where sessions begin and end."""
    home_tolerance_m: float = Field(default=0.05, gt=0, le=1)
    """Largest deviation from there."""
    workspace_min_m: Point
    workspace_max_m: Point
    """The box in which targets may lie."""
    speed_m_s: float = Field(gt=0, le=20)
    acceleration_m_s2: float = Field(gt=0, le=100)
    """Along each direction."""
    inertia_kg_m2: _Inertia | None = None
    """Ixx Iyy Izz Ixy Ixz Iyz about the centre of mass in the platform's frame; one in a plane."""
    centre_of_mass_m: Point | None = None
    """In the platform's frame; its origin if left out."""
    home_rotation_rad: _Rotation | None = None
    """Rotation vector from the room's axes to the platform's at home, an angle in a plane."""
    workspace_angle_rad: float = Field(default=0.0, ge=0)
    """Largest angle from the orientation at home in which targets may lie."""
    angular_speed_rad_s: float | None = Field(default=None, gt=0, le=100)
    angular_acceleration_rad_s2: float | None = Field(default=None, gt=0, le=10_000)
    """About each axis."""
    jerk_m_s3: float | None = Field(default=None, gt=0, le=100_000)
    angular_jerk_rad_s3: float | None = Field(default=None, gt=0, le=10_000_000)
    """Along and about each direction, on paths; such as reach the acceleration in 0.1 s."""
    controlled: tuple[DirectionName, ...] | None = None
    """Directions that the cables control; what they can if left out."""
    tension_distribution: TensionMethod = "minimum-deviation"
    cable_model: CableModelName = "elastic"
    clearance_m: float | None = Field(default=None, gt=0, le=1)
    """Nearer than this, two cables by their centre lines, or a cable and a box, are in contact."""
    body: BoxFile | None = None
    """The platform's body, in its own frame."""
    obstacles: tuple[BoxFile, ...] = Field(default=(), max_length=100)
    """Boxes of the frame and of what stands about, in the room."""


@dataclass(frozen=True)
class Platform:
    """A platform on the cables of a robot's axes; points in the order of the axes.

    `exit_points_m` are in the room, `anchor_points_m` in the platform's frame, whose origin is what
    `home_m` and targets speak of. What is left out (empty, or 0 of an angular speed,
    acceleration or jerk) is filled in: angular speed and acceleration are then those with which the
    furthest anchor point, 0.1 m away at least, moves with `speed_m_s` and `acceleration_m_s2`.
    Jerks that are left out reach these accelerations in 0.1 s.
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
    """Ixx Iyy Izz Ixy Ixz Iyz about the centre of mass, platform's frame; one number in a plane."""
    centre_of_mass_m: tuple[float, ...] = ()
    """In the platform's frame."""
    home_rotation_rad: tuple[float, ...] = ()
    """Rotation vector from the room's axes to the platform's; one number in a plane."""
    workspace_angle_rad: float = 0.0
    """Largest angle from the orientation at home in which targets may lie."""
    angular_speed_rad_s: float = 0.0
    angular_acceleration_rad_s2: float = 0.0
    """About each axis."""
    jerk_m_s3: float = 0.0
    angular_jerk_rad_s3: float = 0.0
    """Along and about each direction, on paths."""
    controlled: tuple[str, ...] = ()
    """Names out of DIRECTIONS, in their order."""
    tension_distribution: str = "minimum-deviation"
    cable_model: str = "elastic"
    clearance_m: float = CLEARANCE_m
    """Nearer than this, two cables by their centre lines, or a cable and a box, are in contact."""
    body: BoxFile | None = None
    """Of the platform, in its own frame."""
    obstacles: tuple[BoxFile, ...] = ()
    """Boxes in the room."""
    pulley_radius_m: tuple[float, ...] = ()
    """One for each axis; 0 for an eye."""
    cable_weights_N_m: tuple[float, ...] = ()
    """Weight per length that counts in lengths and tensions, one for each axis; 0: of none."""
    pulley_axes: tuple[tuple[float, ...], ...] = ()
    """Unit vectors along which the cables come up to their pulleys, one for each axis."""

    def __post_init__(self) -> None:
        """Fill in what was left out."""
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
    def is_planar(self) -> bool:
        """Whether it moves in a plane."""
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

    The positions; and the angles, but where all cables end in one point, and of up to three cables
    in a plane, which leave the platform free to turn.
    """
    size = len(anchor_points_m[0])
    free = len(set(anchor_points_m)) == 1 or (size == 2 and len(anchor_points_m) <= 3)
    return DIRECTIONS[size][: size if free else None]
