"""Events in words from recorded rows."""

from __future__ import annotations

from enum import IntEnum
from typing import Any, Final

import numpy as np

from cdpr_profiles.limits.robot_limits import Limit
from cdpr_rt.core.cycle_row import Row
from cdpr_rt.core.states import LoopState, Reaction
from cdpr_rt.motion.stream_buttons import confirmation

FAILURE: Final = "failure"
"""Kind of the event that a program failed; its text begins with the program's name."""
_WATCHED = ("state", "program", "reaction", "limit", "limit_axis", "stream_buttons")


class EventDetector:
    """Finds changes of state, program and reaction and confirmations in rows.

    In a status it finds reasons, and programs that failed.

    Clamping is no event: it may come and go with every cycle.
    """

    def __init__(self) -> None:
        self._programs: list[str] = []
        self._axes: list[str] = []
        self._last: tuple[int, ...] | None = None
        self._label = ""
        self._reason = self._failure = ""

    def describe(self, description: dict[str, Any]) -> None:
        """Take over the names of programs and axes."""
        self._programs = list(description.get("programs", []))
        self._axes = [axis.get("name", "") for axis in description.get("axes", [])]

    def of_status(self, status: dict[str, Any]) -> list[dict[str, Any]]:
        """Return the failure and the reason that `status` gives, where they are new ones."""
        reason, self._reason = self._reason, str(status.get("reason") or "")
        failure, self._failure = self._failure, str(status.get("failure") or "")
        events: list[dict[str, Any]] = []
        if self._failure not in ("", failure):
            events.append({"text": self._failure, "kind": FAILURE})
        if self._reason not in ("", reason):
            events.append({"text": self._reason, "limit": status.get("reason_limit")})
        return events

    def of_state(self, status: dict[str, Any]) -> dict[str, Any] | None:
        """Return a change of state that only `status` tells; to be asked while no cycles run."""
        label = str(status.get("state") or "")
        if label in ("", self._label):
            return None
        self._label = label
        number = LoopState[label.upper()].value if label.upper() in LoopState.__members__ else -1
        self._last = (number, *(self._last or (0,) * len(_WATCHED))[1:])
        return {"text": f"state {label}"}

    def of_rows(self, rows: Row) -> list[tuple[dict[str, Any], int]]:
        """Return what changed within `rows` (m,) and since the last ones, with stamps."""
        if not rows.size:
            return []
        seen = np.stack([rows[name].astype(np.int64) for name in _WATCHED], axis=1)
        seen[seen[:, 2] <= Reaction.CLAMP, 2:5] = 0
        seen[:, 5] = confirmation(seen[:, 5])
        last = self._last if self._last is not None else (-1, *seen[0, 1:])
        before = np.vstack([np.array(last), seen[:-1]])
        self._last = tuple(int(value) for value in seen[-1])
        self._label = _label(LoopState, self._last[0])
        events = []
        for k in np.flatnonzero((seen != before).any(axis=1)):
            words = self._words(before[k].tolist(), seen[k].tolist())
            if not words:
                continue  # a reaction that is over is told by the state it has led to
            event = {
                "text": words,
                "cycle": int(rows["cycle"][k]),
                "time_s": float(rows["time_s"][k]),
                **{name: int(rows[name][k]) for name in _WATCHED},
            }
            events.append((event, int(rows["stamp_ns"][k])))
        return events

    def _words(self, before: list[int], now: list[int]) -> str:
        words = []
        if now[0] != before[0]:
            words.append(f"state {_label(LoopState, now[0])}")
        if now[1] != before[1]:
            words.append(f"program {_name(self._programs, now[1])}")
        if now[2] and now[2:5] != before[2:5]:
            words.append(_label(Reaction, now[2]))
            if now[3]:
                axis = f" of {_name(self._axes, now[4])}" if now[4] >= 0 else ""
                words[-1] += f" by {_label(Limit, now[3])}{axis}"
        if now[5] and now[5] != before[5]:
            words.append(f"the operator confirmed, number {now[5]}")
        return ", ".join(words)


def _label(kind: type[IntEnum], value: int) -> str:
    return kind(value).name.lower().replace("_", " ") if value in list(kind) else str(value)


def _name(names: list[str], number: int) -> str:
    return names[number] if number < len(names) else str(number)
