"""G-code as a path: lines, arcs, drilling cycles, feeds, offsets, dwells and stops.

Supported are the codes of RS274/NGC that have a meaning for a platform without a tool.
"""

from __future__ import annotations

import math
import re
from contextlib import suppress
from dataclasses import dataclass, field, replace
from typing import Any, Final

import numpy as np

from cdpr_rt.arrays import FloatArray
from cdpr_rt.motion.gcode_words import (
    NEVER_IGNORED,
    Block,
    Findings,
    blocks,
    require_ignorable,
)
from cdpr_rt.motion.path_description import (
    Arc,
    Coordinates,
    LONGEST_DWELL_s,
    Move,
    PathDescription,
)

# Arcs between two points of a plane, by their centre or their radius.

_OFF_m: Final = 2e-5
_OFF_SHARE: Final = 2e-3
"""Largest distance of an arc's end from its circle, due to rounding in the file; the larger value
applies."""
_NOTHING_m: Final = 1e-9
_LARGEST_m: Final = 1000.0
_TURN_rad: Final = 1e-9
"""Smaller rotations are due to rounding."""


def arc_by_centre(start: FloatArray, end: FloatArray, centre: FloatArray, clockwise: bool) -> Arc:
    """Return the arc (2,) around a centre; the whole circle if it ends in the direction in which it
    begins.

    Both ends may have slightly different distances from the centre, due to rounding in the file.
    Raises ValueError if the distances differ by more.
    """
    first, last = start - centre, end - centre
    r, other = float(np.hypot(*first)), float(np.hypot(*last))
    if min(r, other) < _NOTHING_m:
        raise ValueError("its centre is one of its ends")
    if abs(r - other) > max(_OFF_m, _OFF_SHARE * r):
        raise ValueError(
            f"its ends are {1e3 * r:.4f} mm and {1e3 * other:.4f} mm from its centre; "
            "allowed: equal distances"
        )
    angle = _turn(last, first) if clockwise else _turn(first, last)
    if abs(angle) * r < _NOTHING_m:
        angle = 0.0
    angle = angle % math.tau or math.tau
    return Arc(centre.copy(), -angle if clockwise else angle)


def arc_by_radius(start: FloatArray, end: FloatArray, radius: float, clockwise: bool) -> Arc:
    """Return the arc of this radius, m; the longer one of two if it is negative.

    Raises ValueError if no such circle goes through both ends.
    """
    chord = end - start
    length = float(np.hypot(*chord))
    if length < _NOTHING_m:
        raise ValueError("R: it ends where it begins; allowed: I and J for a whole circle")
    if not abs(radius) <= _LARGEST_m:
        raise ValueError(f"R{1e3 * radius:g} mm; allowed: up to {1e3 * _LARGEST_m:g} mm")
    aside = radius**2 - 0.25 * length**2
    if aside < -max(_OFF_m, _OFF_SHARE * abs(radius)) * abs(radius):
        raise ValueError(
            f"R{1e3 * radius:g} mm: its ends are {1e3 * length:g} mm apart; allowed: at least "
            f"{5e2 * length:g} mm"
        )
    left = clockwise == (radius < 0.0)
    normal = np.array([-chord[1], chord[0]]) / length
    away = math.sqrt(max(aside, 0.0)) * (1.0 if left else -1.0)
    centre = 0.5 * (start + end) + away * normal
    angle = _turn(start - centre, end - centre) % math.tau
    return Arc(centre, angle - math.tau if clockwise else angle)


def _turn(first: FloatArray, last: FloatArray) -> float:
    """Return the angle from one vector (2,) to another."""
    return math.atan2(first[0] * last[1] - first[1] * last[0], float(first @ last))


INCH_m: Final = 0.0254
_MM_m: Final = 1e-3
_MOTIONS: Final = ("G0", "G1", "G2", "G3")
_CYCLES: Final = ("G73", "G81", "G82", "G83")
_SYSTEMS: Final = ("G54", "G55", "G56", "G57", "G58", "G59")
_OFFSETS: Final = ("G92", "G92.1", "G92.2", "G92.3")
_PRINTING: Final = ("G10", "G11", "G26", "G29")
"""Retraction, its end, and test and levelling of a printer's bed; G10 L sets data of a machine."""
_PLANES: Final = {"G17": (0, 1, 2), "G18": (2, 0, 1), "G19": (1, 2, 0)}
_GROUPS: Final = (
    (*_MOTIONS, *_CYCLES, "G80"), ("G4", *_PRINTING, "G28", *_OFFSETS), tuple(_PLANES),
    ("G20", "G21", "G70", "G71"), ("G40",), ("G49",), _SYSTEMS, ("G53",),
    ("G61", "G61.1", "G64"), ("G90", "G91"), ("G90.1", "G91.1"), ("G93", "G94"),
    ("G98", "G99"), ("M0", "M2", "M30"), ("G15",), ("G69",), ("G97",),
)  # fmt: skip
"""Supported codes; a line may have one of each group."""
_KNOWN: Final = frozenset(code for group in _GROUPS for code in group)
_LETTERS: Final = {
    "x": "X", "y": "Y", "z": "Z", "rx": "A", "ry": "B", "rz": "C", "angle": "C",
}  # fmt: skip
_MODES: Final[dict[str, tuple[str, Any]]] = {
    "G17": ("plane", "G17"), "G18": ("plane", "G18"), "G19": ("plane", "G19"),
    "G20": ("unit_m", INCH_m), "G21": ("unit_m", _MM_m),
    "G70": ("unit_m", INCH_m), "G71": ("unit_m", _MM_m),
    "G90": ("relative", False), "G91": ("relative", True),
    "G90.1": ("relative_centres", False), "G91.1": ("relative_centres", True),
    "G93": ("inverse_time", True), "G94": ("inverse_time", False),
    "G98": ("back_to_level", True), "G99": ("back_to_level", False),
    "G61": ("blend_m", 0.0), "G61.1": ("blend_m", 0.0),
}  # fmt: skip
"""Modal state that codes set."""
_AXES: Final = frozenset("XYZABCUVW")
_CENTRES: Final = "IJK"
_WHY: Final = {
    "G41": "tool radius compensation is not supported: have the CAM program compensate",
    "G42": "tool radius compensation is not supported: have the CAM program compensate",
    **dict.fromkeys(("M97", "M98", "M99"), "subprograms are not supported"),
}
_LONG_DWELL_s: Final = 10.0
_CLOSE_m: Final = 0.254e-3
"""Height above the last depth at which a peck begins at its feed."""
_LEAST_PECK_m: Final = 1e-5
_MOST_REPEATS: Final = 1000


@dataclass(frozen=True)
class GcodeSettings:
    """Settings that a G-code file does not contain."""

    origin_m: FloatArray
    """Position of its zero (G54) in the room, (k,)."""
    blend_m: float = 1e-3
    """Default tolerance of cut corners (G61, G64 P)."""
    ignored: frozenset[str] = frozenset()
    """Letters to drop, and M codes whose lines to skip."""
    origins_m: dict[str, FloatArray] = field(default_factory=dict)
    """Positions of the zeros of G55 to G59."""
    z_m: float | None = None
    """Z coordinate for a file without Z."""
    placement: FloatArray = field(default_factory=lambda: np.eye(3))
    """Scale, rotation and mirroring of the file, (3, 3): a multiple of an orthogonal matrix."""
    dwell_unit_s: float = 1.0
    """Unit of G4 P."""


@dataclass
class _State:
    """Modal state; lengths are in m, and positions (d,) are relative to the file's zero."""

    here: FloatArray
    """Present position; entries are nan before the file names them."""
    offset: FloatArray
    """Offset of G92: the file's X is `here` minus this."""
    kept_offset: FloatArray
    blend_m: float
    motion: str = "G0"
    plane: str = "G17"
    unit_m: float = _MM_m
    relative: bool = False
    relative_centres: bool = True
    system: str = "G54"
    inverse_time: bool = False
    feed: float = math.nan
    """Feed as given in the file, per minute."""
    feed_unit_m: float = _MM_m
    """Unit of the feed, which is the unit of the line with F."""
    back_to_level: bool = True
    """Whether a drilling cycle ends at the height at which it began (G98)."""
    level_m: float = math.nan
    drilling: dict[str, float] = field(default_factory=dict)


def read_gcode(
    text: str, source: str, coordinates: Coordinates, settings: GcodeSettings
) -> PathDescription:
    """Return the path that a G-code file describes.

    It begins when all coordinates have been named once. X Y Z are mm, or inches after G20, from the
    origin; A B C are degrees about X Y Z from home's orientation, one at a time. F is mm or inches
    per minute along the path; for moves that only turn, degrees per minute. Raises PathError, which
    lists all faults of the file.
    """
    return _Reader(source, coordinates, settings).read(text)


def _without_axis(letter: str) -> str:
    """Return the problem that the robot has no axis of this letter."""
    return f"{letter}: the robot has no such axis; --ignore {letter} drops it from the whole file"


class _LineError(Exception):
    """A line cannot be followed; the message gives the reason."""


class _Reader:
    def __init__(self, source: str, coordinates: Coordinates, settings: GcodeSettings) -> None:
        self._source, self._coordinates, self._settings = source, coordinates, settings
        self._findings = Findings(source)
        self._k = coordinates.positions
        self._letters = [_LETTERS[name] for name in coordinates.names]
        self._known_letters = frozenset((*self._letters, *"FIJKLPQRS"))
        require_ignorable(source, settings.ignored, self._letters)
        k, d = self._k, len(coordinates.names)
        here = np.zeros(d)
        here[:k] = np.nan
        if settings.z_m is not None:
            here[2] = settings.z_m
        self._state = _State(here, np.zeros(d), np.zeros(d), settings.blend_m)
        self._moved = bool((settings.placement != np.eye(3)).any())
        self._turn = _on_all(settings.placement, k, d)
        self._origins = {
            system: np.concatenate([zero, np.zeros(d - k)])
            for system, zero in {"G54": settings.origin_m, **settings.origins_m}.items()
        }
        self._back: FloatArray = np.asarray(np.linalg.inv(self._turn), float)
        self._sign = float(np.sign(np.linalg.det(settings.placement[:k, :k])))
        self._path: PathDescription | None = None
        self._early: list[Move] = []
        """Stops that precede the beginning of the path."""
        self._long_dwells: list[tuple[int, float]] = []
        """Lines and seconds."""
        self._turns: set[str] = set()
        """Rotary axes that the path uses."""
        self._rotary: set[str] = set()
        """Rotary axes that the file names."""
        self._last = 0
        self._in_room = False

    def read(self, text: str) -> PathDescription:
        found = self._findings
        for block in blocks(text, found, self._settings.ignored):
            self._last = block.line
            self._rotary |= block.words.keys() & {*"ABC"}
            try:
                self._execute(block)
            except _LineError as error:
                found.refuse(block.line, str(error))
                self._go_on_from(block)
        if self._path is None or not self._path.moves:
            self._refuse_no_path(text)
        found.require_none()
        assert self._path is not None  # otherwise a problem would have been found
        if self._long_dwells:
            line, seconds = self._long_dwells[0]
            other = "ms" if self._settings.dwell_unit_s == 1.0 else "s"
            more = f" (first of {len(self._long_dwells)})" if len(self._long_dwells) > 1 else ""
            found.notes.append(
                f"line {line}: a dwell of {seconds:g} s{more}; --dwell {other} reads P in {other}"
            )
        if self._turns and len(self._letters) > self._k + 1:
            found.notes.append(
                f"{' '.join(sorted(self._turns))}: turns the platform from home, about X, Y or Z "
                "of the file; it is not a rotary table"
            )
        self._path.notices += found.notices()
        self._path.in_room = self._in_room
        return self._path

    def _refuse_no_path(self, text: str) -> None:
        """Record which coordinates the file never gives, or that nothing moves."""
        found, missing = self._findings, self._missing().split()
        if found.problems:  # a rejected line may contain the missing coordinate
            given = re.findall(r"([A-Z])\s*[-+.0-9#\[]", text.upper())
            missing = [letter for letter in missing if letter not in given]
            if not missing:
                return
        are = "are" if len(missing) > 1 else "is"
        why = f"{' '.join(missing)} {are} never given" if missing else "nothing moves"
        begin = f"begin with a position, such as G0 {'0 '.join(missing)}0" if missing else ""
        rotary = sorted(self._rotary)
        if not rotary or not {*missing} & {*"XY"}:
            hint = ": give the height with --z" if missing == ["Z"] else begin and f"; {begin}"
            found.refuse(self._last, f"{why}; allowed: a path through two positions{hint}")
            return
        for letter in rotary:
            found.problems.pop(_without_axis(letter), None)
        turns = begin and f"; if {rotary[0]} turns the platform, {begin}"
        found.refuse(
            self._last,
            f"{why}, and {' '.join(rotary)} turns the workpiece on a machine with a rotary axis, "
            "which this robot lacks; have the CAM program make a flat path, not one wrapped around "
            f"an axis{turns if {*rotary} <= {*self._letters} else ''}",
        )

    def _execute(self, block: Block) -> None:
        """Execute one line, in the order that RS274 defines."""
        codes, words, state = block.codes, dict(block.words), self._state
        if set(codes) & set(_MOTIONS):  # G80 ends a cycle, as the motion does
            codes = tuple(code for code in codes if code != "G80")
            block = replace(block, codes=codes)
        is_known = self._refuse_unknown(block, words)
        self._set_modes(codes, words)
        if not is_known:
            self._go_on_from(block)
            return
        if "G4" in codes:
            self._dwell(block, words)
        if code := next((one for one in codes if one in _OFFSETS), None):
            self._offset(code, words)
        elif code := next((one for one in codes if one in _PRINTING), None):
            self._data(block, code, words)
        elif "G28" in codes:
            self._to_reference(block, words)
        motion = next((one for one in codes if one in _GROUPS[0]), state.motion)
        if motion != state.motion:
            if motion in _CYCLES and state.motion not in _CYCLES and self._k > 2:
                state.level_m = float(state.here[2])
            state.motion, state.drilling = motion, {}
        if _AXES & set(words) or set(_CENTRES) & set(words) or "R" in words:
            self._move(block, words, in_room="G53" in codes)
        if words:
            letter = next(iter(words))
            advice = "; remove it, or give G2 or G3" if letter in _CENTRES else ""
            raise _LineError(f"{letter}: has no meaning with {motion}{advice}")
        if "M0" in codes:
            self._stop(Move(block.line, self._room(state.here), math.inf, waits=True))

    def _refuse_unknown(self, block: Block, words: dict[str, float]) -> bool:
        """Reject unknown codes and words, and remove unknown words; return whether all codes are
        known.
        """
        unknown = [code for code in block.codes if code not in _KNOWN]
        for code in unknown:
            problem = _WHY.get(code) or "is not supported"
            if code[0] == "M" and code not in NEVER_IGNORED:
                problem += (
                    f"; if it neither moves nor changes later lines, --ignore {code} skips its line"
                )
            self._findings.refuse(block.line, f"{code}: {problem}")
        for group in _GROUPS if len(block.codes) > 1 else ():
            both = sorted({code for code in block.codes if code in group})
            if len(both) > 1:
                raise _LineError(f"{' '.join(both)}: write only one of these codes in a line")
        if self._settings.z_m is not None and "Z" in block.words:
            raise _LineError("Z: --z is only for files without Z")
        for letter in sorted(words.keys() - self._known_letters):
            del words[letter]
            unknown_word = f"{letter}: is not known; --ignore {letter} drops it from the whole file"
            problem = _without_axis(letter) if letter in _AXES else unknown_word
            self._findings.refuse(block.line, problem)
        return not unknown

    def _set_modes(self, codes: tuple[str, ...], words: dict[str, float]) -> None:
        state = self._state
        inverse_time = state.inverse_time
        for code in codes:
            if code in _MODES:
                setattr(state, *_MODES[code])
        if state.plane != "G17" and self._k < 3:
            raise _LineError(f"{state.plane}: the robot moves in a plane; use G17")
        if state.inverse_time != inverse_time:
            state.feed = math.nan
        if "F" in words:
            state.feed, state.feed_unit_m = words.pop("F"), state.unit_m
            if state.feed == 0.0:  # written with G0 by CAM programs that know no speed
                state.feed = math.nan
            elif not state.feed > 0.0:
                raise _LineError(f"F{state.feed:g}: allowed: above 0")
        elif state.inverse_time:
            state.feed = math.nan  # valid for one line only
        if "G64" in codes:
            given = words.pop("P", None)
            words.pop("Q", None)  # tolerance for omitting points, which is not supported
            state.blend_m = self._settings.blend_m if given is None else given * state.unit_m
        for code in codes:
            if code in _SYSTEMS:
                self._select(code)

    # -- coordinates

    def _select(self, system: str) -> None:
        if system not in self._origins:
            raise _LineError(f"{system}: its zero is unknown; give --origin '... {system} X Y Z'")
        room = self._room(self._state.here)
        self._state.system = system
        self._state.here = self._file(room)

    def _room(self, place: FloatArray) -> FloatArray:
        """Convert a position from the file's coordinates to the room, (d,)."""
        turned = _times(self._turn, place) if self._moved else place
        return np.asarray(self._origins[self._state.system] + turned)

    def _file(self, place: FloatArray) -> FloatArray:
        away = place - self._origins[self._state.system]
        return _times(self._back, away) if self._moved else away

    def _value(self, words: dict[str, float], i: int) -> float:
        """Remove the word of a coordinate and return its value in m or rad."""
        unit = self._state.unit_m if i < self._k else math.radians(1.0)
        return words.pop(self._letters[i]) * unit

    def _named(self, words: dict[str, float]) -> list[int]:
        return [i for i, letter in enumerate(self._letters) if letter in words]

    def _target(self, words: dict[str, float]) -> FloatArray:
        """Remove the words of coordinates and return the position that they give, (d,)."""
        state = self._state
        target = state.here.copy()
        for i in self._named(words):
            value = self._value(words, i)
            if not state.relative:
                target[i] = value + state.offset[i]
            else:
                target[i] += value
        return target

    def _start_at_zero(self, block: Block) -> None:
        """Take the file's zero as the position before the first relative move."""
        state = self._state
        assumed = [
            i
            for i in range(self._k)
            if math.isnan(state.here[i]) and (i < 2 or self._letters[i] in block.words)
        ]
        if not assumed:
            return
        state.here[assumed] = state.offset[assumed]
        zeros = " ".join(f"{self._letters[i]}0" for i in assumed)
        self._findings.notes.append(
            f"line {block.line}: a relative move comes first; the path begins at {zeros}"
        )
        self._begin(block.line)

    def _target_in_room(self, words: dict[str, float]) -> FloatArray:
        if self._state.motion not in ("G0", "G1"):
            raise _LineError(f"G53 {self._state.motion}: allowed: G53 with G0 or G1")
        room = self._room(self._state.here)
        for i in self._named(words):
            room[i] = self._value(words, i)
            self._in_room = True
        return self._file(room)

    def _offset(self, code: str, words: dict[str, float]) -> None:
        """Carry out G92 and related codes."""
        state, named = self._state, self._named(words)
        if code != "G92":
            state.offset[:] = state.kept_offset if code == "G92.3" else 0.0
            if code == "G92.1":
                state.kept_offset[:] = 0.0
            return
        if not named and self._findings.ignored.get("E", [0])[-1] != self._last:
            raise _LineError("G92: no axis given")
        for i in named:
            value = self._value(words, i)
            if math.isfinite(state.here[i]):
                state.offset[i] = state.here[i] - value
            else:  # refers to the machine's position before it has moved
                state.here[i] = value
        state.kept_offset[:] = state.offset
        self._begin(self._last)

    def _data(self, block: Block, code: str, words: dict[str, float]) -> None:
        """Skip a code for printers or data, unless it moves the zero of a path that has begun."""
        if words.get("L") in (2.0, 20.0) and self._path is not None:
            raise _LineError(f"{code}: moves the zero within the path; allowed: G92")
        if code != "G10" and _AXES & set(words):
            raise _LineError(f"{code}: allowed only for printers, without axes")
        words.clear()
        self._findings.ignore(block.line, f"the line of {code}")

    # -- motion

    def _move(self, block: Block, words: dict[str, float], in_room: bool) -> None:
        state, motion = self._state, self._state.motion
        if motion == "G80":
            raise _LineError("a position without a motion after G80; give G0 or G1 first")
        if motion in _CYCLES:
            self._drill(block, words)
            return
        if state.relative and not in_room:
            self._start_at_zero(block)
        target = self._target_in_room(words) if in_room else self._target(words)
        arc = self._arc(words, target) if motion in ("G2", "G3") else None
        if self._path is None and arc is not None:
            raise _LineError(f"{motion}: {self._missing() or 'position'} unknown; move there first")
        self._append(block.line, target, motion, arc)

    def _append(self, line: int, target: FloatArray, motion: str, arc: Arc | None = None) -> None:
        """Append a move to `target`; the path begins when all coordinates have been named."""
        state, path = self._state, self._path
        start, state.here = state.here, target
        self._note_turn(start, target)
        if path is None:
            self._begin(line)
            return
        speed = math.inf if motion == "G0" else self._speed(start, target, motion, arc)
        path.add(Move(line, self._room(target), speed, state.blend_m, arc=arc))

    def _note_turn(self, start: FloatArray, target: FloatArray) -> None:
        """Note the rotary axis of a move; reject more than one, whose order is unknown."""
        k, places = self._k, np.array([start, target])
        in_room = np.array([_times(self._turn, place) for place in places])  # as G53 gives them
        most = [np.abs(one[:, k:]).max(axis=0) > _TURN_rad for one in (places, in_room)]
        used = min(most, key=np.count_nonzero)
        turned = [letter for letter, one in zip(self._letters[k:], used, strict=True) if one]
        if len(turned) > 1:
            raise _LineError(
                f"{' '.join(turned)}: machines differ in the order of these rotations; allowed: "
                "only one of A B C other than 0 at a time (or way points with rotation_rad)"
            )
        self._turns.update(turned)

    def _begin(self, line: int) -> None:
        """Begin the path if all coordinates have been named."""
        if self._path is not None or self._missing():
            return
        start = self._room(self._state.here)
        self._path = PathDescription(self._source, self._coordinates, start.copy(), line)
        for stop in self._early:
            self._path.add(Move(stop.line, start, math.inf, 0.0, stop.dwell_s, stop.waits))

    def _speed(self, start: FloatArray, target: FloatArray, motion: str, arc: Arc | None) -> float:
        """Return the speed of a move, m/s, or rad/s if it only turns."""
        state, k = self._state, self._k
        if not math.isfinite(state.feed):
            also = "in the same line (G93)" if state.inverse_time else "before it"
            raise _LineError(f"{motion} without a feed; allowed: F above 0 {also}")
        way = self._room(target) - self._room(start)
        turns_only = arc is None and not way[:k].any()
        if state.inverse_time:
            length = float(np.linalg.norm(way[k:] if turns_only else way[:k]))
            if arc is not None:
                arm, rise = arc.arm_m(self._room(start)[:k]), way[:k] @ arc.normal[:k]
                length = math.hypot(arc.angle_rad * np.linalg.norm(arm), rise)
            return max(length * state.feed / 60.0, 1e-9)
        return state.feed * (math.radians(1.0) if turns_only else state.feed_unit_m) / 60.0

    def _arc(self, words: dict[str, float], target: FloatArray) -> Arc:
        state, start, k = self._state, self._state.here, self._k
        u, v, w = _PLANES[state.plane]
        clockwise, unit_m = state.motion == "G2", state.unit_m
        centre = {i: words.pop(letter) for i, letter in enumerate(_CENTRES) if letter in words}
        if centre.pop(w, 0.0) != 0.0:
            raise _LineError(f"{_CENTRES[w]}: has no meaning in the plane of {state.plane}")
        radius, turns = words.pop("R", None), words.pop("P", 1.0)
        if (radius is None) == (not centre):
            raise _LineError(
                f"{state.motion}: allowed: either {_CENTRES[u]} and {_CENTRES[v]}, or R"
            )
        if centre and not state.relative_centres and len(centre) < 2:
            raise _LineError(
                f"{state.motion}: after G90.1 both {_CENTRES[u]} and {_CENTRES[v]} are needed"
            )
        if not (turns.is_integer() and 1.0 <= turns <= _MOST_REPEATS):
            raise _LineError(f"P{turns:g}: allowed: 1 to {_MOST_REPEATS} turns")
        first, last = start[[u, v]], target[[u, v]]
        try:
            if radius is not None:
                arc = arc_by_radius(first, last, radius * unit_m, clockwise)
            else:
                given = np.array([centre.get(i, 0.0) * unit_m for i in (u, v)])
                bases = first, state.offset[[u, v]]
                if not state.relative_centres:
                    bases = bases[::-1]
                arc = arc_by_centre(first, last, given + bases[0], clockwise)
        except ValueError as error:
            problem = str(error)
            if len(centre) == 2:
                kind, code = ("absolute", "G90.1")
                if not state.relative_centres:
                    kind, code = ("relative", "G91.1")
                with suppress(ValueError):
                    arc_by_centre(first, last, given + bases[1], clockwise)
                    problem = f"its centre fits only as {kind} coordinates: add {code}"
            raise _LineError(f"{state.motion}: {problem}") from None
        place, normal = start.copy(), np.zeros(3)
        place[[u, v]] = arc.centre_m
        if k > 2:
            normal[:k] = self._turn[:k, w] / np.linalg.norm(self._turn[:k, w])
        else:
            normal[2] = 1.0
        angle = arc.angle_rad + math.copysign(math.tau * (turns - 1.0), arc.angle_rad)
        return Arc(self._room(place)[:k], angle, self._sign * normal)

    def _drill(self, block: Block, words: dict[str, float]) -> None:
        """Carry out a drilling cycle at the position that the words name."""
        state, motion, line = self._state, self._state.motion, block.line
        if self._k < 3 or state.plane != "G17":
            raise _LineError(
                f"{motion}: allowed only in the plane of X and Y (G17) of a robot with Z"
            )
        if self._path is None:
            raise _LineError(f"{motion}: {self._missing() or 'position'} unknown; move there first")
        for letter in "ZRPQ":
            if letter in words:
                unit = 1.0 if letter == "P" else state.unit_m
                state.drilling[letter] = words.pop(letter) * unit
        repeats = words.pop("L", 1.0)
        if not (repeats.is_integer() and 1.0 <= repeats <= _MOST_REPEATS):
            raise _LineError(f"L{repeats:g}: allowed: 1 to {_MOST_REPEATS}")
        needed = "ZR" + {"G73": "Q", "G82": "P", "G83": "Q"}.get(motion, "")
        if lacking := [letter for letter in needed if letter not in state.drilling]:
            raise _LineError(f"{motion}: {lacking[0]} is missing")
        given, level = state.drilling, state.level_m
        above = given["R"] + (level if state.relative else state.offset[2])
        bottom = given["Z"] + (above if state.relative else state.offset[2])
        peck_m = given["Q"] if "Q" in needed else math.inf
        if not (bottom <= above and peck_m >= _LEAST_PECK_m):
            least = _LEAST_PECK_m / state.unit_m
            raise _LineError(f"{motion}: allowed: Z below R, and Q of {least:.3g} or more")
        clear = max(level, above) if state.back_to_level else above
        named = {letter: words.pop(letter) for letter in self._letters if letter in words}
        for _ in range(int(repeats)):
            place = self._target(dict(named))
            self._lift(line, state.here, max(state.here[2], above), "G0")
            self._lift(line, place, state.here[2], "G0")
            self._lift(line, place, above, "G0")
            depth = above
            while depth > bottom:
                if depth < above:
                    if motion == "G83":
                        self._lift(line, place, above, "G0")
                    self._lift(line, place, min(depth + _CLOSE_m, above), "G0")
                depth = max(depth - peck_m, bottom)
                self._lift(line, place, depth, "G1")
            if motion == "G82":
                self._rest(line, given["P"] * self._settings.dwell_unit_s)
            self._lift(line, place, clear, "G0")

    def _lift(self, line: int, place: FloatArray, z_m: float, motion: str) -> None:
        """Append a move to a position at another height."""
        target = place.copy()
        target[2] = z_m
        if (target != self._state.here).any():
            self._append(line, target, motion)

    def _to_reference(self, block: Block, words: dict[str, float]) -> None:
        """Append a move to the reference position, through the named position if there is one."""
        state = self._state
        named = self._named(words) or list(range(len(self._letters)))
        for i in self._named(words):
            # a word without a number, or relative to an unknown position, names no point on the way
            unknown = state.relative and not math.isfinite(state.here[i])
            if unknown or not math.isfinite(words[self._letters[i]]):
                del words[self._letters[i]]
        if self._named(words):
            self._append(block.line, self._target(words), "G0")
        room = self._room(state.here)
        room[named] = self._coordinates.reference[named]
        self._append(block.line, self._file(room), "G0")

    # -- stops

    def _dwell(self, block: Block, words: dict[str, float]) -> None:
        if _AXES & set(words) and not set(block.codes) & set(_MOTIONS):
            raise _LineError("G4: give P or S, and no axes without G0 to G3")
        seconds = words.pop("S", math.nan)  # used by 3D printers
        if "P" in words:
            seconds = words.pop("P") * self._settings.dwell_unit_s
        self._rest(block.line, seconds)

    def _rest(self, line: int, seconds: float) -> None:
        if not 0.0 <= seconds <= LONGEST_DWELL_s:
            raise _LineError(f"G4: allowed: P with 0 to {LONGEST_DWELL_s:g} seconds")
        if seconds > _LONG_DWELL_s:
            self._long_dwells.append((line, seconds))
        self._stop(Move(line, self._room(self._state.here), math.inf, dwell_s=seconds))

    def _stop(self, stop: Move) -> None:
        if self._path is None:
            self._early.append(stop)
        else:
            self._path.add(stop)

    # -- faults

    def _missing(self) -> str:
        unknown = np.isnan(self._state.here)
        return " ".join(letter for letter, gone in zip(self._letters, unknown, strict=True) if gone)

    def _go_on_from(self, block: Block) -> None:
        """Continue from the end position of a rejected line, so that later lines can be checked."""
        state = self._state
        if state.relative or set(block.codes) & {"G28", "G53", *_OFFSETS}:
            return
        for i, letter in enumerate(self._letters):
            value = block.words.get(letter, math.nan)
            if math.isfinite(value):
                unit = state.unit_m if i < self._k else math.radians(1.0)
                state.here[i] = value * unit + state.offset[i]


def _on_all(placement: FloatArray, k: int, d: int) -> FloatArray:
    """Extend a placement (3, 3) of positions to all coordinates, (d, d).

    A rotation vector turns with the path. If the path is mirrored, the rotation is reversed.
    """
    every = np.eye(d)
    every[:k, :k] = placement[:k, :k]
    turn = placement / np.cbrt(abs(np.linalg.det(placement)))
    sign = float(np.sign(np.linalg.det(placement)))
    every[k:, k:] = sign * (turn if d - k == 3 else np.eye(d - k))
    return every


def _times(matrix: FloatArray, vector: FloatArray) -> FloatArray:
    """Return the product; unknown entries (nan) are left out if their factor is 0."""
    return np.asarray(np.where(matrix != 0.0, matrix * vector, 0.0).sum(axis=1))
