"""Robots: winches on one bus or several, run as one device."""

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

from pydantic import Field

from profiles.reader import Profile, one_of
from profiles.winch import BITRATES_bit_s, Winch


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


class RobotFile(Profile):
    """A robot as its file has it."""

    name: str = Field(min_length=1)
    notes: tuple[str, ...] = ()
    sync_period_s: float = Field(default=0.001, ge=0.0001, le=1.0)
    master_node_id: int = Field(default=127, ge=1, le=127)
    buses: tuple[RobotBus, ...] = Field(min_length=1, max_length=8)
    axes: tuple[AxisFile, ...] = Field(min_length=1, max_length=64)
    safety_io: str | None = None
    tension_sensors: str | None = None
    rails: tuple[str, ...] = ()

    def faults(self) -> Iterator[tuple[str, str]]:
        """Yield (key, problem) for what contradicts itself."""
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


@dataclass(frozen=True)
class RobotAxis:
    """One axis: its winch, told the robot's bit rate, cycle and node ids."""

    winch: Winch
    bus: str
    node_id: int
    mandatory: bool


@dataclass(frozen=True)
class Robot:
    """A robot with the winches it names; axes keep the order of its file on whatever bus.

    `safety_io`, `tension_sensors` and `rails` are what their own loaders take.
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

    @property
    def reference(self) -> str:
        """What `load_robot` finds this robot by from anywhere: its name, or its file's path."""
        shipped = self.path.parent == Path(__file__).parent / "robots"
        return self.profile if shipped else str(self.path)

    def axes_on(self, bus: str) -> tuple[int, ...]:
        """Return which axes, counted from 0, are on the bus of this name."""
        return tuple(i for i, axis in enumerate(self.axes) if axis.bus == bus)
