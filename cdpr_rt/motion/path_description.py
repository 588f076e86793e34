"""A path as described in its file: a sequence of moves, each with its line in the file."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Final

import numpy as np

from cdpr_profiles.errors import brief
from cdpr_rt.arrays import FloatArray
from cdpr_rt.errors import InvalidRequestError

MOST_MOVES: Final = 200_000
_MOST_CHARS: Final = 1000
_MOST_PROBLEMS: Final = 40
"""Largest number of lines in an error message, one for each problem."""
LONGEST_DWELL_s: Final = 3600.0


class PathError(InvalidRequestError):
    """A path cannot be followed; the message gives file, line, value and allowed values."""

    def __init__(self, source: Path | str, line: int, problem: str) -> None:
        lines = problem.split("\n")[:_MOST_PROBLEMS]
        self.source, self.line = str(source), line
        self.problem = "\n".join(brief(text, _MOST_CHARS) for text in lines)
        where = f"{self.source}:{line}" if line else self.source
        super().__init__(f"{where}: {self.problem}")


@dataclass(frozen=True)
class Coordinates:
    """Entries of a position (d,) of a path by name, coordinates first."""

    names: tuple[str, ...]
    """Names out of x y z rx ry rz, or x y angle; rx ry rz is the rotation vector from home's
    orientation."""
    reference: FloatArray
    """Target of G28, (d,)."""

    @property
    def positions(self) -> int:
        """Number of entries in m; the others are in rad."""
        return sum(name in ("x", "y", "z") for name in self.names)


@dataclass(frozen=True)
class Arc:
    """A part of a circle around an axis; coordinates outside its plane change evenly."""

    centre_m: FloatArray
    """A point of the axis, (3,), or (2,) if the axis is along z."""
    angle_rad: float
    """Angle, positive counter-clockwise if seen against the normal; it may be more than one
    turn."""
    normal: FloatArray = field(default_factory=lambda: np.array([0.0, 0.0, 1.0]))
    """Direction of the axis, a unit vector (3,)."""

    def arm_m(self, start: FloatArray) -> FloatArray:
        """Return the vector (3,) from the axis to the arc's start, a position of 2 or 3 entries."""
        size = min(len(self.centre_m), len(start))
        arm = np.zeros(3)
        arm[:size] = start[:size] - self.centre_m[:size]
        return np.asarray(arm - (arm @ self.normal) * self.normal)


@dataclass(frozen=True)
class Move:
    """One move to a position, with its speed and the stop or wait at its end."""

    line: int
    """Line in the file."""
    end: FloatArray
    """(d,), m and rad."""
    speed: float
    """Largest wanted speed, m/s; rad/s for a pure rotation; infinite for the robot's limit."""
    blend_m: float = 0.0
    """Blending radius: the corner at the end may be cut within this distance."""
    dwell_s: float = 0.0
    """Time at rest at the end of the move."""
    waits: bool = False
    """Whether the path waits at the end of the move for a command to continue."""
    arc: Arc | None = None


@dataclass
class PathDescription:
    """A path: its first position, and the moves from there on."""

    source: str
    coordinates: Coordinates
    start: FloatArray
    """The first position, (d,)."""
    start_line: int
    moves: list[Move] = field(default_factory=list)
    notices: list[str] = field(default_factory=list)
    """Notes for the user about how the file was read."""
    in_room: bool = False
    """Whether the file gives positions in the room (G53) instead of relative to its own zero."""

    def add(self, move: Move) -> None:
        """Append a move; raises PathError if there are too many or it is impossible."""
        if len(self.moves) >= MOST_MOVES:
            raise PathError(self.source, move.line, f"too many moves; allowed: {MOST_MOVES}")
        if not np.isfinite(move.end).all():
            raise PathError(self.source, move.line, "a coordinate is not finite")
        self.moves.append(move)

    @property
    def points(self) -> FloatArray:
        """All named positions, (m + 1, d), including the first one."""
        return np.array([self.start, *(move.end for move in self.moves)])

    @property
    def lines(self) -> list[int]:
        """Lines of these positions in the file."""
        return [self.start_line, *(move.line for move in self.moves)]

    def index_of(self, line: int) -> int:
        """Return the first move at or after a line of the file; raises PathError if there is
        none.
        """
        for i, move in enumerate(self.moves):
            if move.line >= line:
                return i
        raise PathError(self.source, line, "there is no motion from this line on")

    def part(self, begin: int, end: int) -> PathDescription:
        """Return the path of the moves begin to end - 1, from the end of the move before."""
        start, line = (
            (self.moves[begin - 1].end, self.moves[begin - 1].line)
            if begin
            else (self.start, self.start_line)
        )
        moves = self.moves[begin:end]
        return replace(self, start=start, start_line=line, moves=moves)
