"""A hand that follows a written script: `cdpr teleop ROBOT --device script --script FILE`."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path

from cdpr_profiles.bounded_input import read_text
from cdpr_profiles.errors import ProfileError, brief
from cdpr_rt.service.stream_packet import REACH_M
from cdpr_tools.errors import BadInputError
from cdpr_tools.teleop.input_device import End, InputSample, Vector, from_vector

_WORDS = ("clutch", "confirm")
_SHAPE = "seconds x_mm y_mm [z=MM] [turn=RX,RY,RZ] [clutch] [confirm]"
_LARGEST_TURN_deg = 180.0
_LONGEST_m = 20.0
_LARGEST = {1: 1e3 * _LONGEST_m, 3: _LARGEST_TURN_deg}
_MOST_BYTES = 1 << 20


@dataclass(frozen=True)
class ScriptLine:
    """Position of the hand at a time, in s and m, and its state from then on."""

    time_s: float
    position_m: Vector
    turn_rad: Vector = (0.0, 0.0, 0.0)
    """Rotation vector."""
    clutch: bool = False
    """Whether the clutch is open until the next line."""
    confirm: bool = False
    """Whether the hand confirms once, at this time."""


def read_script(path: Path, scale: float = 1.0) -> tuple[ScriptLine, ...]:
    """Return the lines of a script; raises BadInputError, which names file and line.

    `#` begins a comment. Between two lines the hand moves straight at constant speed. No line
    moves a robot further than set-points can reach at `scale`.
    """
    try:
        text = read_text(path, _MOST_BYTES)
    except ProfileError as error:
        raise BadInputError(f"--script {error}") from None
    lines: list[ScriptLine] = []
    for number, raw in enumerate(text.splitlines(), 1):
        words = raw.partition("#")[0].split()
        if words:
            line = _parsed(f"--script {path}, line {number}", words)
            if lines and line.time_s <= lines[-1].time_s:
                raise BadInputError(
                    f"--script {path}, line {number}: {line.time_s:g} s; allowed: more than "
                    f"{lines[-1].time_s:g} s, the time of the previous line"
                )
            lines.append(line)
            way_m, most_m = (
                math.dist(line.position_m, lines[0].position_m),
                REACH_M / max(scale, 1.0),
            )
            if way_m > most_m:
                raise BadInputError(
                    f"--script {path}, line {number}: {way_m:g} m from the first "
                    "position; allowed: "
                    f"{most_m:g} m at this scale"
                )
    if not lines:
        raise BadInputError(f"--script {path}: no lines; allowed: {_SHAPE}")
    return tuple(lines)


def _parsed(where: str, words: list[str]) -> ScriptLine:
    try:
        time_s, x_mm, y_mm = (float(word) for word in words[:3])
    except ValueError:
        raise BadInputError(f"{where}: {brief(' '.join(words))!r}; allowed: {_SHAPE}") from None
    z_mm, turn = 0.0, (0.0, 0.0, 0.0)
    for word in words[3:]:
        key, _, value = word.partition("=")
        if key == "z":
            (z_mm,) = _numbers(where, word, value, 1)
        elif key == "turn":
            x, y, z = (math.radians(angle) for angle in _numbers(where, word, value, 3))
            turn = (x, y, z)
        elif word not in _WORDS:
            allowed = ", ".join((*_WORDS, "z=", "turn="))
            raise BadInputError(f"{where}: {brief(word)!r}; allowed: {allowed}")
    if not (math.isfinite(time_s) and time_s >= 0.0):
        raise BadInputError(f"{where}: {brief(words[0])} s; allowed: 0 or more")
    x, y, z = x_mm * 1e-3, y_mm * 1e-3, z_mm * 1e-3
    if not (abs(x) <= _LONGEST_m and abs(y) <= _LONGEST_m and abs(z) <= _LONGEST_m):
        raise BadInputError(f"{where}: {x_mm:g} {y_mm:g} mm; allowed: up to {_LONGEST_m:g} m")
    return ScriptLine(time_s, (x, y, z), turn, "clutch" in words[3:], "confirm" in words[3:])


def _numbers(where: str, word: str, text: str, count: int) -> list[float]:
    try:
        numbers = [float(number) for number in text.split(",")]
    except ValueError:
        numbers = []
    if len(numbers) != count or not all(abs(number) <= _LARGEST[count] for number in numbers):
        allowed = f"{count} of up to {_LARGEST[count]:g}"
        raise BadInputError(f"{where}: {brief(word)!r}; allowed: numbers, {allowed}")
    return numbers


class ScriptDevice:
    """Plays a script from the first read on; positions are relative to its first line."""

    hint = "a script moves the hand; Ctrl-C ends"

    def __init__(self, lines: tuple[ScriptLine, ...]) -> None:
        self._lines = lines
        self._begin_s = math.nan

    def read(self, now_s: float) -> InputSample:
        """Return the present sample; it reports the end after the last line."""
        if math.isnan(self._begin_s):
            self._begin_s = now_s
        lines, time_s = self._lines, now_s - self._begin_s
        done = sum(line.time_s <= time_s for line in lines)
        last = lines[max(done - 1, 0)]
        towards, part = last, 0.0
        if 0 < done < len(lines):
            towards = lines[done]
            part = (time_s - last.time_s) / (towards.time_s - last.time_s)
        x, y, z = (
            here + part * (there - here) - first
            for here, there, first in zip(
                last.position_m, towards.position_m, lines[0].position_m, strict=True
            )
        )
        rx, ry, rz = (
            here + part * (there - here)
            for here, there in zip(last.turn_rad, towards.turn_rad, strict=True)
        )
        return InputSample(
            (x, y, z),
            from_vector((rx, ry, rz)),
            clutch=done > 0 and last.clutch,
            confirmed=sum(line.confirm for line in lines[:done]),
            end=End("the script has ended", arrive=True) if done == len(lines) else None,
        )

    def close(self) -> None:
        """Do nothing: nothing is open."""
