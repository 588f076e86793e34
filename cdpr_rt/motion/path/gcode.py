"""G-code as a path: lines and arcs in the plane of X and Y, feeds, dwells and stops.

The codes are those of RS274/NGC as far as they mean something to a platform without a tool.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Final

import numpy as np

from cdpr_rt.arrays import FloatArray
from cdpr_rt.motion.path.arcs import arc_by_centre, arc_by_radius
from cdpr_rt.motion.path.description import (
    Arc,
    Coordinates,
    LONGEST_DWELL_s,
    Move,
    PathDescription,
    PathError,
)
from cdpr_rt.motion.path.gcode_words import Block, blocks

INCH_m: Final = 0.0254
_MM_m: Final = 1e-3
_MOTIONS: Final = ("G0", "G1", "G2", "G3")

_KNOWN: Final = (
    *_MOTIONS, "G4", "G17", "G20", "G21", "G28", "G40", "G49", "G53", "G54", "G61", "G64", "G80",
    "G90", "G91", "G94", "M0", "M2", "M30",
)  # fmt: skip
_LETTERS: Final = {
    "x": "X", "y": "Y", "z": "Z", "rx": "A", "ry": "B", "rz": "C", "angle": "C",
}  # fmt: skip


@dataclass(frozen=True)
class GcodeSettings:
    """Settings that a G-code file does not contain."""

    origin_m: FloatArray
    """Position of its zero (G54) in the room, (k,)."""
    blend_m: float = 1e-3
    """Default tolerance of cut corners (G61, G64 P)."""
    ignored: frozenset[str] = frozenset()
    """Letters and codes that are skipped, such as S, M3."""


@dataclass
class _State:
    """Modal state."""

    motion: str = "G0"
    unit_m: float = _MM_m
    relative: bool = False
    feed: float = math.nan
    """In units of the file a minute."""
    blend_m: float = 0.0
    here: FloatArray = field(default_factory=lambda: np.zeros(0))
    """(d,), nan where nothing has been said yet."""


def read_gcode(
    text: str, source: str, coordinates: Coordinates, settings: GcodeSettings
) -> PathDescription:
    """Return the path that a G-code file describes.

    It begins where all coordinates have been named once. X Y Z are mm, or inch after G20, from the
    origin; A B C degrees, the rotation vector from the orientation at home. F is mm or inch a
    minute along the path; of moves that only turn, degrees a minute. Raises PathError.
    """
    return _Reader(source, coordinates, settings).read(text)


class _Reader:
    def __init__(self, source: str, coordinates: Coordinates, settings: GcodeSettings) -> None:
        self._source, self._coordinates, self._settings = source, coordinates, settings
        self._k = coordinates.positions
        self._letters = [_LETTERS[name] for name in coordinates.names]
        here = np.zeros(len(coordinates.names))
        here[: self._k] = np.nan
        self._state = _State(blend_m=settings.blend_m, here=here)
        self._path: PathDescription | None = None

    def read(self, text: str) -> PathDescription:
        last = 0
        for block in blocks(text, self._source, self._settings.ignored):
            self._execute(block)
            last = block.line
        if self._path is None or not self._path.moves:
            missing = self._missing()
            why = f"{missing} never named" if missing else "nothing moves"
            raise PathError(self._source, last, f"{why}; allowed: a path through two positions")
        return self._path

    def _execute(self, block: Block) -> None:
        """Carry out one line, in the order that RS274 has."""
        codes, words, state = list(block.codes), dict(block.words), self._state
        self._refuse_unknown(block, codes)
        if "G20" in codes or "G21" in codes:
            state.unit_m = INCH_m if "G20" in codes else _MM_m
        if "F" in words:
            state.feed = words.pop("F")
            if not state.feed > 0.0:
                raise self._error(block, f"F{state.feed:g}: allowed: above 0")
        if "G61" in codes:
            state.blend_m = 0.0
        if "G64" in codes:
            given = words.pop("P", None)
            state.blend_m = self._settings.blend_m if given is None else given * state.unit_m
        if "G4" in codes:
            self._dwell(block, words)
        if "G90" in codes or "G91" in codes:
            state.relative = "G91" in codes
        motions = [code for code in codes if code in _MOTIONS]
        if len(motions) > 1:
            raise self._error(block, f"{' '.join(motions)}: allowed: one of them in a line")
        state.motion = motions[0] if motions else state.motion
        if "G28" in codes:
            self._to_reference(block, words)
        elif any(letter in words for letter in (*self._letters, "I", "J", "R")):
            self._move(block, words, in_room="G53" in codes)
        if words:
            raise self._error(block, f"{next(iter(words))}: has no meaning here")
        if "M0" in codes:
            self._stop(Move(block.line, self._state.here, math.inf, waits=True))

    def _refuse_unknown(self, block: Block, codes: list[str]) -> None:
        for code in codes:
            if code not in _KNOWN:
                raise self._error(
                    block, f"{code}: not known; allowed: {' '.join(_KNOWN)}, or leave it out"
                )
        for letter in block.words:
            if letter not in (*self._letters, "F", "I", "J", "P", "R"):
                raise self._error(
                    block,
                    f"{letter}{block.words[letter]:g}: not known; allowed: "
                    f"{' '.join(self._letters)} F I J P R, or leave it out",
                )

    # -- motion

    def _target(self, block: Block, words: dict[str, float], in_room: bool) -> FloatArray:
        """Return the position that the words name, (d,); takes them out."""
        state, k = self._state, self._k
        target = state.here.copy()
        for i, letter in enumerate(self._letters):
            if letter not in words:
                continue
            value = words.pop(letter) * (state.unit_m if i < k else math.radians(1.0))
            if state.relative and not in_room:
                if not math.isfinite(target[i]):
                    raise self._error(block, f"{letter}: by how much, but from where? G90 first")
                target[i] += value
            else:
                target[i] = value + (0.0 if in_room or i >= k else self._settings.origin_m[i])
        return target

    def _move(self, block: Block, words: dict[str, float], in_room: bool) -> None:
        motion = self._state.motion
        target = self._target(block, words, in_room)
        arc = self._arc(block, words, target) if motion in ("G2", "G3") else None
        if self._path is None and arc is not None:
            raise self._error(block, f"{motion}: {self._missing()} not named before")
        self._append(block, target, arc)

    def _append(self, block: Block, target: FloatArray, arc: Arc | None) -> None:
        """Go to `target`; the path begins where all coordinates are named."""
        state, path = self._state, self._path
        if path is None:
            state.here = target
            if not self._missing():
                self._path = PathDescription(
                    self._source, self._coordinates, target.copy(), block.line
                )
            return
        speed = math.inf
        if state.motion != "G0":
            if not math.isfinite(state.feed):
                raise self._error(block, f"{state.motion} without a feed; allowed: F before it")
            turns_only = arc is None and not (target - state.here)[: self._k].any()
            unit = math.radians(1.0) if turns_only else state.unit_m
            speed = state.feed * unit / 60.0
        state.here = target
        path.add(Move(block.line, target, speed, state.blend_m, arc=arc))

    def _arc(self, block: Block, words: dict[str, float], target: FloatArray) -> Arc:
        state, start = self._state, self._state.here
        clockwise = state.motion == "G2"
        centre = [words.pop(letter, None) for letter in ("I", "J")]
        radius = words.pop("R", None)
        if (radius is None) == (centre == [None, None]):
            raise self._error(block, f"{state.motion}: allowed: either I and J, or R")
        try:
            if radius is not None:
                return arc_by_radius(start[:2], target[:2], radius * state.unit_m, clockwise)
            away = np.array([value or 0.0 for value in centre]) * state.unit_m
            return arc_by_centre(start[:2], target[:2], start[:2] + away, clockwise)
        except ValueError as error:
            raise self._error(block, f"{state.motion}: {error}") from None

    def _to_reference(self, block: Block, words: dict[str, float]) -> None:
        """Go to the reference position, through the position that is named, if any is."""
        named = [i for i, letter in enumerate(self._letters) if letter in words]
        motion, self._state.motion = self._state.motion, "G0"
        if named:
            self._move(block, words, in_room=False)
        target = self._state.here.copy()
        for i in named or range(len(target)):
            target[i] = self._coordinates.reference[i]
        self._append(block, target, None)
        self._state.motion = motion

    # -- stops

    def _dwell(self, block: Block, words: dict[str, float]) -> None:
        seconds = words.pop("P", math.nan)
        if not 0.0 <= seconds <= LONGEST_DWELL_s:
            raise self._error(block, f"G4: allowed: P with 0 to {LONGEST_DWELL_s:g} seconds")
        self._stop(Move(block.line, self._state.here, math.inf, dwell_s=seconds))

    def _stop(self, stop: Move) -> None:
        if self._path is not None:  # before, there is nothing to be stopped
            self._path.add(stop)

    # -- what is wrong

    def _missing(self) -> str:
        unknown = np.isnan(self._state.here)
        return " ".join(letter for letter, gone in zip(self._letters, unknown, strict=True) if gone)

    def _error(self, block: Block, problem: str) -> PathError:
        return PathError(self._source, block.line, problem)
