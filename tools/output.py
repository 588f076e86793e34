"""Output of a command: text for people, one JSON line for programs, progress on standard error."""

from __future__ import annotations

import json
import math
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
from rich.console import Console, ConsoleOptions, RenderableType
from rich.progress import (
    BarColumn,
    Progress,
    SpinnerColumn,
    TextColumn,
    TimeElapsedColumn,
    TimeRemainingColumn,
)
from rich.segment import Segment
from typing_extensions import override

from cdpr_profiles.errors import printable

_SLOW_S = 2.0
_ESTIMATED_FROM = 0.005
"""Share of the work after which the remaining time is shown."""
_TELL_S = (2.0, 5.0)
"""Without a terminal: time of the first report of continuing work, then the interval."""


def _plain(value: Any) -> Any:
    """Convert numpy values and non-finite numbers to JSON values."""
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


class _Terminal(Console):
    """A console on which only styles and bars control the terminal, never text."""

    def __init__(self, *, stderr: bool) -> None:
        super().__init__(stderr=stderr, highlight=False, emoji=False, markup=False)

    @override
    def render(
        self, renderable: RenderableType, options: ConsoleOptions | None = None
    ) -> Iterator[Segment]:
        for segment in super().render(renderable, options):
            if segment.control:
                yield segment
            else:
                yield Segment(printable(segment.text), segment.style)


class Output:
    """Output of a command; `as_json` reserves standard output for the single JSON line."""

    def __init__(self, as_json: bool) -> None:
        self.as_json = as_json
        self.notes = _Terminal(stderr=True)
        self.text = self.notes if as_json else _Terminal(stderr=False)
        self._bar: Progress | None = None

    def say(self, *lines: str) -> None:
        """Write lines for people."""
        for line in lines:
            self.text.print(printable(line), soft_wrap=True)

    def note(self, text: str) -> None:
        """Write a line about the present work to standard error."""
        self.notes.print(printable(text), style="dim", soft_wrap=True)

    def result(self, result: dict[str, Any]) -> None:
        """Write the JSON line if requested; it is the last line of standard output."""
        if self.as_json:
            print(to_json(result), flush=True)

    @contextmanager
    def progress(self, what: str, total_s: float) -> Iterator[Advance]:
        """Show the progress over `total_s` seconds of bus time while the block runs.

        It shows a bar on a terminal, otherwise a line from time to time.
        """
        columns = (
            TextColumn("{task.description}", markup=False),
            BarColumn(),
            TimeElapsedColumn(),
            TimeRemainingColumn(),
        )
        with self._shown(columns, Advance(what, total_s), total_s >= _SLOW_S) as advance:
            yield advance

    @contextmanager
    def stage(self, what: str, quick: bool = False) -> Iterator[None]:
        """Show the present work immediately, and that it continues while the block runs.

        `quick` work is shown immediately only on a terminal, where it is erased at the end.
        """
        if not quick and not self.notes.is_interactive:
            self.note(f"{what} ...")
        columns = (
            SpinnerColumn(),
            TextColumn("{task.description}", markup=False),
            TimeElapsedColumn(),
        )
        with self._shown(columns, Advance(what, None), True):
            yield

    @contextmanager
    def paused(self) -> Iterator[None]:
        """Draw nothing while the block runs, so that the user can type."""
        bar = self._bar
        if bar is None:
            yield
            return
        bar.stop()
        try:
            yield
        finally:
            bar.start()

    @contextmanager
    def _shown(self, columns: Any, advance: Advance, shown: bool) -> Iterator[Advance]:
        if not shown:
            yield advance
        elif self.notes.is_interactive:
            with Progress(*columns, console=self.notes, transient=True) as bar:
                task = bar.add_task(advance.what, total=advance.total)
                advance.on_change = lambda: bar.update(task, completed=advance.done)
                self._bar = bar
                try:
                    yield advance
                finally:
                    self._bar = None
        else:
            with self._noted_now_and_then(advance):
                yield advance

    @contextmanager
    def _noted_now_and_then(self, advance: Advance) -> Iterator[None]:
        over = threading.Event()

        def tell() -> None:
            wait_s, again_s = _TELL_S
            while not over.wait(wait_s):
                self.note(advance.text())
                wait_s = again_s

        teller = threading.Thread(target=tell, daemon=True)
        teller.start()
        try:
            yield
        finally:
            over.set()
            teller.join()


class Advance:
    """Progress of work; call it with the seconds of bus time that have passed."""

    def __init__(self, what: str, total: float | None) -> None:
        self.what, self.total, self.done = what, total, 0.0
        self.on_change: Callable[[], None] = lambda: None
        self._begun_s = time.monotonic()

    def __call__(self, time_s: float) -> None:
        """Set the progress to `time_s` seconds; 0 starts the work after any wait."""
        if not time_s:
            self._begun_s = time.monotonic()
        self.done = time_s
        self.on_change()

    def text(self) -> str:
        """Return the progress as text, and the estimated remaining time."""
        elapsed_s = time.monotonic() - self._begun_s
        if not self.total:
            return f"{self.what}: for {elapsed_s:.0f} s now"
        # a file that is still being written grows beyond its initial size
        share = min(self.done / self.total, 1.0)
        if share < _ESTIMATED_FROM:
            return f"{self.what}: 0 %"
        left_s = elapsed_s * (1.0 / share - 1.0)
        left = f"{left_s:.0f} s" if left_s < 100.0 else f"{left_s / 60.0:.0f} min"
        return f"{self.what}: {100.0 * share:.0f} %, about {left} left"


def time_text(seconds: float) -> str:
    """Return a duration: 12.34 s, 3 min 20 s, 2 h 5 min."""
    if seconds < 60.0:
        return f"{seconds:.2f} s"
    minutes, rest = divmod(round(seconds), 60)
    hours, minutes = divmod(minutes, 60)
    return f"{hours} h {minutes} min" if hours else f"{minutes} min {rest} s"
