"""Summarise a recording: figures, motions and why they ended, and events."""

from __future__ import annotations

import math
import re
from bisect import bisect_left
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Final

import numpy as np

from cdpr_rt.arrays import FloatArray
from cdpr_rt.core.states import LoopState, Reaction
from cdpr_rt.service.recording import FAILURE
from cdpr_rt.service.recording_reader import CLOSED, Columns, RecordingReader
from cdpr_tools.client.status_text import DEAD
from cdpr_tools.output import Output
from cdpr_tools.recordings.selection import ELAPSED, Selection, is_being_written

_EARLY_ns: Final = 50_000_000
"""A reason may be stamped this long before the row that shows its reaction."""

WHILE_ACTIVE: Final = "the recording ends while the robot was active"
LOOP_ENDED: Final = "the control loop ended without a stop"
_WRITER_ENDED: Final = "its writer was killed, or a daemon of another user still writes it"


class Reasons:
    """The reasons that a loop gave, each stamped when its status was read, soon after the reaction.

    Stamps are CLOCK_MONOTONIC, in ns.
    """

    def __init__(self, events: Iterable[tuple[int, dict[str, Any]]]) -> None:
        """Take events, each with its stamp."""
        self._stamped = sorted(
            (at_ns, str(event["text"])) for at_ns, event in events if is_reason(event)
        )

    def after(self, at_ns: int, next_ns: float = float("inf")) -> str:
        """Return the reason for a reaction at `at_ns`, or ""; the next reaction is at `next_ns`.

        A state that follows a reaction has the same reason.
        """
        return self.stamped_after(at_ns, next_ns)[1]

    def stamped_after(self, at_ns: int, next_ns: float = float("inf")) -> tuple[int, str]:
        """Return the reason with its stamp, -1 for none; stamps distinguish equal texts."""
        k = bisect_left(self._stamped, (at_ns - _EARLY_ns, ""))
        if k < len(self._stamped) and self._stamped[k][0] < next_ns - _EARLY_ns:
            return self._stamped[k]
        return -1, ""


def is_reason(event: dict[str, Any]) -> bool:
    """Return whether an event is a reason, from the service or from the loop's status."""
    return event.get("kind") == "reason" or ("limit" in event and "cycle" not in event)


def is_fault(event: dict[str, Any]) -> bool:
    """Return whether an event is the reaction to a limit, or a change of state to fault."""
    of_row = "reaction" in event and "cycle" in event
    return of_row and (event["reaction"] > Reaction.CLAMP or "state fault" in event["text"])


def why_while_active(reader: RecordingReader, last_state: int) -> str:
    """Return why a recording, read to its end, ends while active; its last state is `last_state`.

    Returns "" if that state is not active, another file continues the recording, or it still goes
    on.
    """
    if last_state != LoopState.ACTIVE:
        return ""
    if DEAD in reader.states:
        return LOOP_ENDED
    next_name = f"{reader.metadata.get('session')}-{reader.part + 1:03d}.mcap"
    if reader.ended == CLOSED or reader.path.with_name(next_name).exists():
        return ""
    if is_being_written(reader.path):
        return ""
    return _WRITER_ENDED


_FIELDS = (
    "cycle",
    "stamp_ns",
    "state",
    "lateness_s",
    "exchange_s",
    "compute_s",
    "late_cycles",
    "missed",
    "program",
    "reaction",
    "position_rad",
    "pose",
    "pose_setpoint",
)
_EVERY = 20


@dataclass
class _Count:
    """Figures of one file, accumulated while its rows are read."""

    rows: int = 0
    missing_cycles: int = 0
    restarts: int = 0
    first_s: float = 0.0
    last_s: float = 0.0
    longest: dict[str, float] = field(default_factory=dict)
    states_s: dict[str, float] = field(default_factory=dict)
    began: dict[str, int] = field(default_factory=dict)
    last: dict[str, int] = field(default_factory=dict)
    last_state: int = LoopState.UNCONFIGURED
    stamps_ns: list[FloatArray] = field(default_factory=list)
    elapsed_s: list[FloatArray] = field(default_factory=list)
    """Times of some of the rows, in monotonic time and in bus time."""
    runs: list[dict[str, Any]] = field(default_factory=list)
    """The runs in order: program, seconds, and the positions of axes and platform at the end."""

    def add(self, rows: Columns) -> None:
        """Add some rows."""
        elapsed, cycle = rows[ELAPSED], rows["cycle"]
        for kept, column in ((self.stamps_ns, "stamp_ns"), (self.elapsed_s, ELAPSED)):
            kept += [rows[column][::_EVERY], rows[column][-1:]]
        if self.rows == 0:
            self.first_s = float(elapsed[0])
            self.began = {name: int(rows[name][0]) for name in ("missed", "late_cycles")}
        else:
            elapsed = np.concatenate([[self.last_s], elapsed])
            cycle = np.concatenate([[self.last["cycle"]], cycle])
        self._add_runs(rows)
        steps = np.diff(cycle)
        self.missing_cycles += int((steps[steps > 1] - 1).sum())
        self.restarts += int((steps <= 0).sum())
        spent = np.diff(elapsed)
        state = rows["state"][-spent.size :] if spent.size else rows["state"][:0]
        for value in np.unique(state):
            label = LoopState(value).label if value in list(LoopState) else str(value)
            passed = float(spent[state == value].sum())
            self.states_s[label] = self.states_s.get(label, 0.0) + passed
        for name in ("lateness_s", "exchange_s", "compute_s"):
            self.longest[name] = float(
                np.fmax.reduce(rows[name], initial=self.longest.get(name, math.nan))
            )
        self.last = {name: int(rows[name][-1]) for name in ("cycle", "missed", "late_cycles")}
        self.last_s, self.last_state = float(rows[ELAPSED][-1]), int(rows["state"][-1])
        self.rows += rows["cycle"].size

    def _add_runs(self, rows: Columns) -> None:
        program, active = rows["program"], rows["state"] == LoopState.ACTIVE
        elapsed = rows[ELAPSED] - self.first_s
        kind = np.where(active, program.astype(int), -1)
        reacts = (rows["reaction"] > Reaction.CLAMP) | (rows["state"] == LoopState.FAULT)
        ends = [*np.flatnonzero(np.diff(kind)), kind.size - 1]
        for begin, end in zip([0, *(k + 1 for k in ends)], ends, strict=False):
            found = np.flatnonzero(reacts[begin : end + 1])
            stamps_ns = rows["stamp_ns"][begin + found[:1]]
            if not self.runs or self.runs[-1]["program"] != kind[begin]:
                reaction = bool(reacts[begin])  # a reaction here ended the previous run
                if self.runs and reaction:
                    self._cut_short(stamps_ns)
                at_s = float(elapsed[begin])
                self.runs.append(
                    {"program": int(kind[begin]), "from_s": at_s, "reaction": reaction}
                )
            self._cut_short(stamps_ns)
            last = {name: rows[name][end].tolist() for name in ("pose", "pose_setpoint")}
            angles = rows["position_rad"][end].tolist()
            self.runs[-1] |= {"until_s": float(elapsed[end]), "position_rad": angles, **last}

    def _cut_short(self, stamps_ns: FloatArray) -> None:
        """Note when the last run was cut short, unless it is itself part of a reaction.

        `stamps_ns` are the stamps of rows with a reaction; without such rows, the run was not cut
        short.
        """
        run = self.runs[-1]
        if stamps_ns.size and not run["reaction"]:
            run.setdefault("cut_ns", int(stamps_ns[0]))

    def when_s(self, stamp_ns: float) -> float:
        """Return the recording's time, as `cdpr log plot` counts it, at a wall-clock time."""
        stamps_ns, elapsed_s = np.concatenate(self.stamps_ns), np.concatenate(self.elapsed_s)
        at_s = float(np.interp(stamp_ns, stamps_ns, elapsed_s)) - self.first_s
        # before the first row and after the last one only the wall clock is known
        before_s, after_s = stamps_ns[0] - stamp_ns, stamp_ns - stamps_ns[-1]
        return at_s + 1e-9 * float(max(after_s, 0.0) - max(before_s, 0.0))

    def result(self) -> dict[str, Any]:
        """Return the figures of the file."""
        counted = {name: self.last[name] - self.began[name] for name in self.began}
        return {
            "rows": self.rows,
            "seconds": self.last_s - self.first_s,
            "missing_cycles": self.missing_cycles,
            "restarts": self.restarts,
            **counted,
            **{f"longest_{name}": value for name, value in self.longest.items()},
            "states_s": self.states_s,
        }


def summarise(path: Path, out: Output) -> dict[str, Any]:
    """Return the figures of one file. Raises BadInputError if it is not a recording."""
    selection = Selection([path], _FIELDS)
    count = _Count()
    with out.progress(path.name, selection.reading_s) as selection.advance:
        for rows in selection.rows():
            count.add(rows)
    (reader,) = selection.readers
    for event in reader.events:
        stamp_ns = event["log_time_ns"] - reader.offset_ns
        event["after_s"] = count.when_s(stamp_ns) if count.rows else None
    runs = _named_runs(count.runs, reader)
    why = why_while_active(reader, count.last_state)
    _note_failures(runs, reader.events)
    if why == LOOP_ENDED:  # a file that is still being written may be fine
        runs[-1].setdefault("cut_short_by", why)
    return {
        "file": str(path),
        "bytes": path.stat().st_size,
        "ended": reader.ended,
        "being_recorded": reader.ended != CLOSED and is_being_written(path),
        "ended_while_active": why or None,
        "robot": reader.metadata.get("robot"),
        "session": reader.metadata.get("session"),
        "part": reader.part,
        "axes": reader.axes,
        "period_s": reader.description.get("period_s"),
        **count.result(),
        "runs": runs,
        "events": sorted(reader.events, key=lambda event: int(event["log_time_ns"])),
    }


def _named_runs(runs: list[dict[str, Any]], reader: RecordingReader) -> list[dict[str, Any]]:
    """Return the runs with power, with their programs' names and why they were cut short."""
    programs = reader.description.get("programs", [])
    reasons = Reasons((event["log_time_ns"] - reader.offset_ns, event) for event in reader.events)
    cuts = [run["cut_ns"] for run in runs if "cut_ns" in run]
    found: list[dict[str, Any]] = []
    for run in runs:
        number, cut_ns = run["program"], run.get("cut_ns")
        named = programs[number] if 0 <= number < len(programs) else str(number)
        named_run = {**run, "program": named}
        if cut_ns is not None:
            later = [other for other in cuts if other > cut_ns]
            why = reasons.after(cut_ns, min(later, default=math.inf)) or "a fault"
            # if the power is removed immediately, the last cycles belong to the idle program
            cut = found[-1] if found and named == "idle" else named_run
            if not cut["reaction"]:  # a reaction itself is not cut short
                cut.setdefault("cut_short_by", why)
        found.append(named_run)
    return [
        {key: value for key, value in one.items() if key != "cut_ns"}
        for run, one in zip(runs, found, strict=True)
        if run["program"] >= 0
    ]


def _note_failures(runs: list[dict[str, Any]], events: Sequence[dict[str, Any]]) -> None:
    """Write into runs why they failed; the event comes during the run or soon after it."""
    for event in (one for one in events if one.get("kind") == FAILURE):
        name, _, why = event["text"].partition(": ")
        before = [
            run for run in runs if run["program"] == name and run["from_s"] <= event["after_s"]
        ]
        if before:
            before[-1]["failed_by"] = why


def _run_text(run: dict[str, Any], axes: Sequence[str]) -> str:
    """Return when a program ran, why it was cut short, and the final position, as text."""
    pose, setpoint = np.array(run["pose"], float), np.array(run["pose_setpoint"], float)
    if np.isfinite(pose).all():
        size = 3 if pose[2] else 2  # in a plane the third coordinate is 0
        at = ", ".join(f"{x:z.1f}" for x in 1e3 * pose[:size])
        where = f"platform at {at} mm"
        if np.isfinite(setpoint).all():
            off_mm = 1e3 * float(np.linalg.norm(pose[:3] - setpoint[:3]))
            where += f", {off_mm:.1f} mm from its set-point"
    else:
        angles = np.degrees(np.array(run["position_rad"], float))
        known = [
            f"{name} {x:.1f}" for name, x in zip(axes, angles, strict=False) if not np.isnan(x)
        ]
        where = f"{', '.join(known)} deg" if known else "positions unknown"
    time = f"{run['from_s']:10.3f} s to {run['until_s']:9.3f} s"
    why = f"failed: {run['failed_by']}; then" if "failed_by" in run else "ended,"
    if "cut_short_by" in run:
        why = f"interrupted: {run['cut_short_by']}; then"
    return f"  {time}  {run['program']}: {why} {where}"


def _is_wrong(event: dict[str, Any]) -> bool:
    return is_reason(event) or is_fault(event) or event.get("kind") == FAILURE


def _chosen(events: Sequence[dict[str, Any]], most: int) -> list[dict[str, Any]]:
    """Return at most `most` events: failures and reasons first, then the newest of the others."""
    wrong = [k for k, event in enumerate(events) if _is_wrong(event)][-most:]
    others = [k for k in range(len(events)) if k not in wrong]
    kept = {*wrong, *others[len(others) - (most - len(wrong)) :]}
    return [event for k, event in enumerate(events) if k in kept]


def worth_telling(events: Sequence[dict[str, Any]]) -> list[dict[str, Any]]:
    """Return events without grants and program changes, which the list of motions shows.

    Repeated refusals are counted in one event.
    """
    found: list[dict[str, Any]] = []
    for event in events:
        is_change = "cycle" in event and re.fullmatch(r"program \S+", event["text"]) is not None
        if event.get("kind") == "control" or is_change:
            continue
        if found and _alike(event["text"], found[-1]["text"]):
            found[-1]["times"] += 1
            continue
        found.append({**event, "times": 1})
    return found


def _alike(text: str, last: str) -> bool:
    refused = ": refused: "
    if refused in text and refused in last:
        return text.split(refused, maxsplit=1)[0] == last.split(refused, maxsplit=1)[0]
    return text == last


def summary_lines(figures: dict[str, Any], most_events: int) -> Sequence[str]:
    """Return the figures of one file as lines of text."""
    end = {
        "closed": "",
        "not closed": ", not closed by its writer",
        "cut short": ", truncated",
    }
    lines = [
        f"{figures['file']}: {figures['robot']}, {len(figures['axes'])} axes, "
        f"{figures['bytes'] / 1e6:.1f} MB"
        f"{', still being recorded' if figures['being_recorded'] else end[figures['ended']]}"
    ]
    states = ", ".join(f"{name} {time_s:.1f} s" for name, time_s in figures["states_s"].items())
    lines.append(f"  {figures['rows']} cycles in {figures['seconds']:.1f} s ({states})")
    lines.append(
        f"  {figures['missing_cycles']} cycles not recorded, {figures.get('late_cycles', 0)} late, "
        f"{figures.get('missed', 0)} answers missed"
    )
    if figures["rows"]:
        longest = [
            f"{what} {1e3 * figures[f'longest_{name}']:.3f} ms"
            for what, name in (
                ("late by", "lateness_s"),
                ("answers after", "exchange_s"),
                ("computing", "compute_s"),
            )
            if not math.isnan(figures[f"longest_{name}"])
        ]
        lines += [f"  at most: {', '.join(longest)}"] if longest else []
    if figures["ended_while_active"]:
        lines.append(f"  {WHILE_ACTIVE}: {figures['ended_while_active']}")
    runs = [run for run in figures["runs"] if run["program"] not in ("hold", "idle")]
    if len(runs) > most_events:
        lines.append(f"  ({len(runs) - most_events} earlier motions are in --json)")
    lines += [_run_text(run, figures["axes"]) for run in runs[-most_events:]]
    events = worth_telling(figures["events"])
    shown = _chosen(events, most_events)
    if len(events) > len(shown):
        lines.append(f"  ({len(events) - len(shown)} more events are in --json)")
    for event in shown:
        at = f"{event['after_s']:10.3f} s" if event["after_s"] is not None else " " * 12
        times = f" ({event['times']} times)" if event["times"] > 1 else ""
        lines.append(f"  {at}  {event['text']}{times}")
    return lines
