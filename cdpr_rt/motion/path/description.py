"""A path as its file has it: moves one after the other, each with its line in the file."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import Final

import numpy as np

from cdpr_rt.arrays import FloatArray
from cdpr_rt.errors import InvalidRequestError

MOST_MOVES: Final = 200_000
LONGEST_DWELL_s: Final = 3600.0


class PathError(InvalidRequestError):
    """A path that cannot be followed; names file and line, the value and what is allowed."""

    def __init__(self, source: Path | str, line: int, problem: str) -> None:
        self.source, self.line, self.problem = str(source), line, problem
        where = f"{self.source}:{line}" if line else self.source
        super().__init__(f"{where}: {problem}")


@dataclass(frozen=True)
class Coordinates:
    """Entries of a position (d,) of a path by name, coordinates first."""

    names: tuple[str, ...]
    """Out of x y z rx ry rz, or x y angle; rotations are the vector from the one at home."""
    reference: FloatArray
    """Target of G28, (d,)."""

    @property
    def positions(self) -> int:
        """Number of entries in m; the others are in rad."""
        return sum(name in ("x", "y", "z") for name in self.names)


@dataclass(frozen=True)
class Arc:
    """A part of a circle in the plane of the first two coordinates; all others change evenly."""

    centre_m: FloatArray
    """(2,)"""
    angle_rad: float
    """Positive counter-clockwise."""


@dataclass(frozen=True)
class Move:
    """One move to a position, and what happens there."""

    line: int
    """In the file."""
    end: FloatArray
    """(d,), m and rad."""
    speed: float
    """Wanted at most, m/s; of a move that only turns rad/s. Infinite: what the robot allows."""
    blend_m: float = 0.0
    """The corner at its end may be cut within this distance of it."""
    dwell_s: float = 0.0
    """Time at rest at its end."""
    waits: bool = False
    """Whether it waits at its end until it is told to go on."""
    arc: Arc | None = None


@dataclass
class PathDescription:
    """Moves from a first position on."""

    source: str
    coordinates: Coordinates
    start: FloatArray
    """(d,)"""
    start_line: int
    moves: list[Move] = field(default_factory=list)

    def add(self, move: Move) -> None:
        """Append a move; raises PathError for one too many or none that can be."""
        if len(self.moves) >= MOST_MOVES:
            raise PathError(self.source, move.line, f"too many moves; allowed: {MOST_MOVES}")
        if not np.isfinite(move.end).all():
            raise PathError(self.source, move.line, "a coordinate is not finite")
        self.moves.append(move)

    @property
    def points(self) -> FloatArray:
        """All positions that are named, (m + 1, d), the first one included."""
        return np.array([self.start, *(move.end for move in self.moves)])

    @property
    def lines(self) -> list[int]:
        """Their lines in the file."""
        return [self.start_line, *(move.line for move in self.moves)]
