"""Robots: winches on one bus or several, run as one device."""

from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Annotated

from pydantic import Field

from profiles.platform import Platform, PlatformFile, Point, platform_faults
from profiles.reader import Profile, one_of
from profiles.robot_limits import RobotLimits
from profiles.winch import BITRATES_bit_s, Winch
from profiles.winch_calibration import WinchCalibration

HEARTBEATS_WAITED = 1.75
"""Periods of the master's heartbeat after which its drives take it for lost: fewer than two."""


class RobotBus(Profile):
    """One CAN bus of a robot; `url` is where it is found unless a command is told otherwise."""

    name: str = Field(pattern=r"^[A-Za-z0-9][A-Za-z0-9_-]{0,14}$")
    url: str | None = Field(default=None, min_length=1)
    bitrate_bit_s: Annotated[int, one_of(*BITRATES_bit_s)] = 1_000_000


class AxisFile(Profile):
    """One axis as the file has it; `winch` is the name or path of a winch profile."""

    winch: str
    bus: str
    node_id: int = Field(ge=1, le=127)
    mandatory: bool = True
    name: str | None = Field(default=None, min_length=1, max_length=32)
    cable_sign: Annotated[int, one_of(-1, 1)] | None = None
    calibration: str | None = None
    commissioned: str | None = Field(default=None, min_length=1)
    """Folder in which `cdpr commission` left its motor's profile, or the profile's file."""
    exit_point_m: Point | None = None
    """Where its cable leaves for the platform."""
    anchor_point_m: Point | None = None
    """Where its cable is made fast, in the platform's frame."""


class RobotFile(Profile):
    """A robot as its file has it."""

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
        """Yield (key, problem) for what contradicts itself."""
        yield from self.limits.faults(len(self.axes))
        yield from self._repeated_names()
        yield from self._unbounded_tensions()
        yield from platform_faults(
            self.platform,
            [axis.exit_point_m for axis in self.axes],
            [axis.anchor_point_m for axis in self.axes],
        )
        if self.master_heartbeat_s < 2 * self.sync_period_s:
            allowed = f"allowed: at least two cycles ({2 * self.sync_period_s:g})"
            yield "master_heartbeat_s", f"value {self.master_heartbeat_s:g}; {allowed}"
        names = [bus.name for bus in self.buses]
        for i, bus in enumerate(self.buses):
            if bus.name in names[:i]:
                yield f"buses[{i}].name", f"value {bus.name!r}; allowed: each name once"
            elif all(axis.bus != bus.name for axis in self.axes):
                yield f"buses[{i}].name", f"value {bus.name!r}; allowed: a bus that an axis is on"
        taken: dict[tuple[str, int], int] = {}
        nodes: dict[int, int] = {}
        for i, axis in enumerate(self.axes):
            if axis.bus not in names:
                yield f"axes[{i}].bus", f"value {axis.bus!r}; allowed: {', '.join(names)}"
            if axis.node_id == self.master_node_id:
                problem = f"value {axis.node_id}; allowed: another than master_node_id"
                yield f"axes[{i}].node_id", problem
            first = taken.setdefault((axis.bus, axis.node_id), i)
            if first != i:
                problem = (
                    f"value {axis.node_id}; allowed: each node id once on a bus, "
                    f"axes[{first}] has it on {axis.bus!r}"
                )
                yield f"axes[{i}].node_id", problem
            other = nodes.setdefault(axis.node_id, i)
            if self.safety_io is not None and self.axes[other].bus != axis.bus:
                problem = (
                    f"value {axis.node_id}; allowed: each node id once on all buses where there is "
                    f"a safety_io, which knows its brakes by it (axes[{other}] has it too)"
                )
                yield f"axes[{i}].node_id", problem

    def _unbounded_tensions(self) -> Iterator[tuple[str, str]]:
        if self.platform is not None:
            for key in ("tension_min_N", "tension_max_N"):
                if getattr(self.limits, key) is None:
                    yield f"limits.{key}", "missing; allowed: given where there is a [platform]"

    def _repeated_names(self) -> Iterator[tuple[str, str]]:
        names = [axis.name or default_name(i) for i, axis in enumerate(self.axes)]
        for i, name in enumerate(names):
            if name in names[:i]:
                where = f"axes[{names.index(name)}]"
                yield f"axes[{i}].name", f"value {name!r}; allowed: each once, {where} has it"


def default_name(axis: int) -> str:
    """Return what the axis of this number is called where its file does not say."""
    return f"axis {axis}"


@dataclass(frozen=True)
class RobotAxis:
    """One axis: its winch, told the robot's bit rate, cycle, node ids and heartbeat.

    `name` is what messages call it; `calibration` its measured tension-to-torque gain,
    `commissioned` where its motor's cogging profile is: a file, or the folder that holds it.
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
    """A robot with the winches it names; axes keep the order of its file on whatever bus.

    `safety_io`, `tension_sensors` and `rails` are what their own loaders take. The master's
    heartbeat goes out every `master_heartbeat_s`; the drives stop by themselves (1016h, 6007h)
    when they miss it for `HEARTBEATS_WAITED` of that.
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
    """What the axes hold together; None for winches that have nothing in common."""
    is_winch: bool = False
    """Whether it is a single winch, run as a robot of one axis; its file is that of the winch."""

    @property
    def reference(self) -> str:
        """What `load_robot` finds this robot by from anywhere: its name, or its file's path."""
        kind = "winches" if self.is_winch else "robots"
        shipped = self.path.parent == Path(__file__).parent / kind
        return self.profile if shipped else str(self.path)

    def axes_on(self, bus: str) -> tuple[int, ...]:
        """Return which axes, counted from 0, are on the bus of this name."""
        return tuple(i for i, axis in enumerate(self.axes) if axis.bus == bus)


def robot_of_winch(winch: Winch) -> Robot:
    """Return a winch as the robot of one axis that it is, with a robot's limits and heartbeat."""
    heartbeat_s = max(0.1, 2 * winch.sync_period_s)
    bus = RobotBus(name="can0", bitrate_bit_s=winch.bitrate_bit_s)
    axis = RobotAxis(
        watched_by_heartbeat(winch, heartbeat_s),
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


def watched_by_heartbeat(winch: Winch, master_heartbeat_s: float) -> Winch:
    """Return `winch` with a drive that takes its master for lost in fewer than two heartbeats."""
    waits_s = HEARTBEATS_WAITED * master_heartbeat_s
    drive = winch.drive.model_copy(update={"heartbeat_consumer_s": waits_s})
    return replace(winch, drive=drive)
