"""What a command shows: text for people, one JSON line for programs, progress on standard error."""

from __future__ import annotations

import json
import math
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
from rich.console import Console
from rich.progress import BarColumn, Progress, TaskID, TextColumn, TimeElapsedColumn

_SLOW_S = 2.0


def _plain(value: Any) -> Any:
    """Turn numpy values and non-finite numbers into what JSON knows."""
    if isinstance(value, dict):
        return {str(k): _plain(v) for k, v in value.items()}
    if isinstance(value, list | tuple):
        return [_plain(v) for v in value]
    if isinstance(value, np.ndarray):
        return _plain(value.tolist())
    if isinstance(value, np.bool_ | np.integer):
        return value.item()
    if isinstance(value, float | np.floating):
        return float(value) if math.isfinite(value) else None
    return str(value) if isinstance(value, Path) else value


def to_json(result: dict[str, Any], indent: int | None = None) -> str:
    """Return `result` as strict JSON; numbers that are not finite become null."""
    return json.dumps(_plain(result), indent=indent, allow_nan=False)


class Output:
    """Where a command writes; `as_json` keeps standard output for the one JSON line."""

    def __init__(self, as_json: bool) -> None:
        self.as_json = as_json
        self.notes = Console(stderr=True, highlight=False, emoji=False)
        self.text = self.notes if as_json else Console(highlight=False, emoji=False)

    def say(self, *lines: str) -> None:
        """Write lines for people."""
        for line in lines:
            self.text.print(line, markup=False, soft_wrap=True)

    def note(self, text: str) -> None:
        """Write a line on what is going on, to standard error."""
        self.notes.print(text, markup=False, style="dim", soft_wrap=True)

    def result(self, result: dict[str, Any]) -> None:
        """Write the JSON line, when it is wanted; it is the last line of standard output."""
        if self.as_json:
            print(to_json(result), flush=True)

    @contextmanager
    def progress(self, what: str, total_s: float) -> Iterator[Advance]:
        """Show a bar over `total_s` seconds of bus time while the block runs.

        On a terminal only: elsewhere nothing could be drawn over again.
        """
        columns = (TextColumn("{task.description}"), BarColumn(), TimeElapsedColumn())
        shown = total_s >= _SLOW_S and self.notes.is_interactive
        bar = Progress(*columns, console=self.notes, transient=True, disable=not shown)
        with bar:
            yield Advance(bar, bar.add_task(what, total=total_s))


class Advance:
    """Moves a progress bar; call it with the seconds of bus time that have passed."""

    def __init__(self, bar: Progress, task: TaskID) -> None:
        self._bar = bar
        self._task = task

    def __call__(self, time_s: float) -> None:
        """Show that `time_s` seconds are done."""
        self._bar.update(self._task, completed=time_s)
