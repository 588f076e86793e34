"""Robots: winches on one or several buses, run as one device."""

from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from pydantic import Field

from cdpr_profiles.places import reference
from cdpr_profiles.platform import Direction, Platform, PlatformFile, Point, platform_faults
from cdpr_profiles.reader import Profile, one_of
from cdpr_profiles.robot_limits import RobotLimits
from cdpr_profiles.winch import BITRATES_bit_s, Winch
from cdpr_profiles.winch_calibration import WinchCalibration

if TYPE_CHECKING:
    from cdpr_profiles.geometry_calibration import GeometryCalibration

HEARTBEAT_TIMEOUT_PERIODS = 1.75
"""Heartbeat timeout of the drives in periods of the master's heartbeat, less than two."""


class RobotBus(Profile):
    """One CAN bus of a robot; `url` is its default, which commands may override."""

    name: str = Field(pattern=r"^[A-Za-z0-9][A-Za-z0-9_-]{0,14}$")
    url: str | None = Field(default=None, min_length=1)
    bitrate_bit_s: Annotated[int, one_of(*BITRATES_bit_s)] = 1_000_000


class AxisFile(Profile):
    """One axis in the file; `winch` is the name or path of a winch profile."""

    winch: str
    bus: str
    node_id: int = Field(ge=1, le=127)
    mandatory: bool = True
    name: str | None = Field(default=None, min_length=1, max_length=32)
    cable_sign: Annotated[int, one_of(-1, 1)] | None = None
    calibration: str | None = None
    commissioned: str | None = Field(default=None, min_length=1)
    """Folder in which `cdpr commission` wrote its motor's profile, or the profile's file."""
    exit_point_m: Point | None = None
    """Point where the cable leaves the frame."""
    anchor_point_m: Point | None = None
    """Point where the cable is fixed to the platform, in the platform's frame."""
    pulley_radius_m: float = Field(default=0.0, ge=0, le=1)
    """Radius of the pulley at the exit point; 0 for an eye."""
    pulley_axis: Direction | None = None
    """Swivel axis of that pulley, the direction in which the cable arrives; by default up."""


class RobotFile(Profile):
    """The file of a robot."""

    name: str = Field(min_length=1)
    notes: tuple[str, ...] = ()
    sync_period_s: float = Field(default=0.001, ge=0.0001, le=1.0)
    master_node_id: int = Field(default=127, ge=1, le=127)
    master_heartbeat_s: float = Field(default=0.1, ge=0.01, le=10)
    buses: tuple[RobotBus, ...] = Field(min_length=1, max_length=8)
    axes: tuple[AxisFile, ...] = Field(min_length=1, max_length=64)
    safety_io: str | None = None
    tension_sensors: str | None = None
    rails: tuple[str, ...] = ()
    limits: RobotLimits = RobotLimits()
    platform: PlatformFile | None = None

    def faults(self) -> Iterator[tuple[str, str]]:
        """Yield (key, problem) for values that contradict each other."""
        yield from self.limits.faults(len(self.axes))
        yield from self._repeated_names()
        yield from self._unbounded_tensions()
        yield from platform_faults(
            self.platform,
            [axis.exit_point_m for axis in self.axes],
            [axis.anchor_point_m for axis in self.axes],
            [axis.pulley_axis for axis in self.axes],
        )
        if self.master_heartbeat_s < 2 * self.sync_period_s:
            allowed = f"allowed: at least two cycles ({2 * self.sync_period_s:g})"
            yield "master_heartbeat_s", f"value {self.master_heartbeat_s:g}; {allowed}"
        yield from self._bus_faults()
        yield from self._node_faults()

    def _bus_faults(self) -> Iterator[tuple[str, str]]:
        names = [bus.name for bus in self.buses]
        for i, bus in enumerate(self.buses):
            if bus.name in names[:i]:
                yield f"buses[{i}].name", f"value {bus.name!r}; allowed: each name once"
            elif all(axis.bus != bus.name for axis in self.axes):
                yield (
                    f"buses[{i}].name",
                    f"value {bus.name!r}; allowed: a bus with at least one axis",
                )

    def _node_faults(self) -> Iterator[tuple[str, str]]:
        names = [bus.name for bus in self.buses]
        first_on_bus: dict[tuple[str, int], int] = {}
        first_of_all: dict[int, int] = {}
        for i, axis in enumerate(self.axes):
            if axis.bus not in names:
                yield f"axes[{i}].bus", f"value {axis.bus!r}; allowed: {', '.join(names)}"
            if axis.node_id == self.master_node_id:
                problem = f"value {axis.node_id}; allowed: any but master_node_id"
                yield f"axes[{i}].node_id", problem
            first = first_on_bus.setdefault((axis.bus, axis.node_id), i)
            if first != i:
                problem = (
                    f"value {axis.node_id}; axes[{first}] already has it on bus {axis.bus!r}; give "
                    "each drive on a bus another node id"
                )
                yield f"axes[{i}].node_id", problem
            other = first_of_all.setdefault(axis.node_id, i)
            if self.safety_io is not None and self.axes[other].bus != axis.bus:
                problem = (
                    f"value {axis.node_id}; axes[{other}] already has it; the safety_io identifies "
                    "brakes by node id, so give each drive on all buses another one"
                )
                yield f"axes[{i}].node_id", problem

    def _unbounded_tensions(self) -> Iterator[tuple[str, str]]:
        if self.platform is not None:
            for key in ("tension_min_N", "tension_max_N"):
                if getattr(self.limits, key) is None:
                    yield f"limits.{key}", "missing; required with a [platform]"

    def _repeated_names(self) -> Iterator[tuple[str, str]]:
        names = [axis.name or default_name(i) for i, axis in enumerate(self.axes)]
        for i, name in enumerate(names):
            if name in names[:i]:
                where = f"axes[{names.index(name)}]"
                yield (
                    f"axes[{i}].name",
                    f"value {name!r}; allowed: each once, but {where} also has it",
                )


def default_name(axis: int) -> str:
    """Return the default name of the axis with this index from 0; names count from 1."""
    return f"axis {axis + 1}"


@dataclass(frozen=True)
class RobotAxis:
    """One axis: its winch, which takes bit rate, cycle, node ids and heartbeat from the robot.

    `name` is its name in messages, `calibration` its measured tension-to-torque gain,
    `commissioned` the path of its motor's cogging profile: a file, or the folder that holds it.
    """

    winch: Winch
    bus: str
    node_id: int
    mandatory: bool
    name: str
    calibration: WinchCalibration | None = None
    commissioned: Path | None = None


@dataclass(frozen=True)
class Robot:
    """A robot with the winches it names; axes keep the order of its file on all buses.

    `safety_io`, `tension_sensors` and `rails` are arguments of their loaders. The master sends its
    heartbeat every `master_heartbeat_s`. The drives stop (1016h, 6007h) if none arrives for
    `HEARTBEAT_TIMEOUT_PERIODS` of that time.
    """

    profile: str
    path: Path
    name: str
    sync_period_s: float
    master_node_id: int
    buses: tuple[RobotBus, ...]
    axes: tuple[RobotAxis, ...]
    safety_io: str | None = None
    tension_sensors: str | None = None
    rails: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()
    master_heartbeat_s: float = 0.1
    limits: RobotLimits = field(default_factory=RobotLimits)
    platform: Platform | None = None
    """The platform on the axes; None for independent winches."""
    calibration: "GeometryCalibration | None" = None
    """The calibration applied to the platform and the winches; None for the file's geometry."""
    is_winch: bool = False
    """Whether it is a single winch, run as a robot of one axis; its file is that of the winch."""

    @property
    def geometry_identity(self) -> str:
        """Identity of the calibration of the geometry; empty if the file's geometry applies."""
        return "" if self.calibration is None else self.calibration.identity

    @property
    def reference(self) -> str:
        """Reference for `load_robot` from any folder: the robot's name, or its file's path."""
        return reference("winches" if self.is_winch else "robots", self.path)

    def axes_on(self, bus: str) -> tuple[int, ...]:
        """Return the axes, counted from 0, on the bus of this name."""
        return tuple(i for i, axis in enumerate(self.axes) if axis.bus == bus)


def robot_of_winch(winch: Winch) -> Robot:
    """Return a winch as a robot of one axis, with a robot's limits and heartbeat."""
    heartbeat_s = max(0.1, 2 * winch.sync_period_s)
    bus = RobotBus(name="can0", bitrate_bit_s=winch.bitrate_bit_s)
    axis = RobotAxis(
        with_heartbeat_timeout(winch, heartbeat_s),
        bus.name,
        winch.node_id,
        mandatory=True,
        name=default_name(0),
    )
    return Robot(
        profile=winch.profile,
        path=winch.path,
        name=winch.name,
        sync_period_s=winch.sync_period_s,
        master_node_id=winch.master_node_id,
        buses=(bus,),
        axes=(axis,),
        notes=winch.notes,
        master_heartbeat_s=heartbeat_s,
        is_winch=True,
    )


def with_heartbeat_timeout(winch: Winch, master_heartbeat_s: float) -> Winch:
    """Return `winch` with the drive's heartbeat timeout derived from the master's heartbeat."""
    timeout_s = HEARTBEAT_TIMEOUT_PERIODS * master_heartbeat_s
    drive = winch.drive.model_copy(update={"heartbeat_consumer_s": timeout_s})
    return replace(winch, drive=drive)
