"""Output of a command: text for people, one JSON line for programs, progress on standard error."""

from __future__ import annotations

import json
import math
import os
import re
import threading
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from textwrap import wrap
from typing import IO, Any, Final, Self

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
from rich.text import Text
from typing_extensions import override

from cdpr_profiles.errors import printable
from cdpr_tools.streams import procedure_token

_PROGRESS_S: Final = 0.2
"""Shortest time between two lines of a procedure's progress."""
_SLOW_S = 2.0
_ESTIMATED_FROM = 0.005
"""Share of the work after which the remaining time is shown."""
_TELL_S = (2.0, 5.0)
"""Without a terminal: time until the first report that work continues, then the interval."""


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


_KEPT: Final = re.compile(r"`[^`]*`|(?:(?<=: )|(?<=^ {6}))cdpr .*")
"""A command within a text: somebody may copy it, so it stays in one line."""
_GAPS: Final = re.compile(r"^\s+|\s{2,}(?=\S)")
"""The gap between a label and the text after it."""
_SPACE: Final = "\0"
_LEAST_TEXT: Final = 20
"""Smallest width, in characters, of a text next to its label and of the first column of a table."""


def fold(text: str, width: int | None) -> str:
    """Break the lines of a text between words, so that they fit into `width` columns.

    Paths and quoted commands are not broken, even if they are longer. Further lines are indented
    like the text after a label at the beginning ("loop       gain margin ..."). Without a width
    nothing changes, as in a pipe.
    """
    if width is None:
        return text
    return "\n".join(_fold_line(line, width) for line in text.split("\n"))


def _fold_line(line: str, width: int) -> str:
    if len(line) <= width:
        return line
    gaps = [gap.end() for gap in _GAPS.finditer(line) if gap.end() <= width - _LEAST_TEXT]
    indent = max(gaps, default=0)
    whole = _KEPT.sub(lambda found: found[0].replace(" ", _SPACE), line)
    folded = wrap(
        whole,
        width,
        subsequent_indent=" " * indent,
        break_long_words=False,
        break_on_hyphens=False,
    )
    return "\n".join(folded).replace(_SPACE, " ")


def _folded(text: Text, width: int | None) -> Text:
    """Return a styled text, folded at the same places as its plain text."""
    lines, end = [], 0
    for line in fold(text.plain, width).split("\n"):
        words = line.lstrip(" ")
        begin = text.plain.index(words, end)
        end = begin + len(words)
        lines.append(Text(" " * (len(line) - len(words))) + text[begin:end])
    return Text("\n").join(lines)


class TableText(str):
    """A table as text, which `Output.say` fits into the terminal; the first row is its header.

    The first column has labels and is aligned to the left, like the columns named in `left`.
    """

    _rows: Sequence[Sequence[str]]
    _left: Sequence[str]

    def __new__(cls, rows: Sequence[Sequence[str]], left: Sequence[str] = ()) -> Self:
        """Lay the table out at its full width."""
        self = super().__new__(cls, "\n".join(_columns(rows, _aligned(rows, left))))
        self._rows, self._left = rows, left
        return self

    def within(self, width: int | None) -> str:
        """Return the table in `width` columns: labels are folded, other columns follow below."""
        widths = _widths(self._rows)
        if width is None or _total(widths) <= width:
            return str(self)
        label = max(min(width - _total(widths[1:]) - _GAP, widths[0]), min(_LEAST_TEXT, widths[0]))
        parts: list[list[int]] = [[]]
        for i, one in enumerate(widths[1:], 1):
            if parts[-1] and _total([label, *(widths[j] for j in parts[-1]), one]) > width:
                parts.append([])
            parts[-1].append(i)
        aligned = _aligned(self._rows, self._left)
        lines: list[str] = []
        for part in parts:
            shown = [0, *part]
            rows = [[row[i] for i in shown] for row in self._rows]
            rows = [more for row in rows for more in _folded_label(row, label)]
            lines += [*[""] * bool(lines), *_columns(rows, [aligned[i] for i in shown])]
        return "\n".join(lines)

    def __rich_console__(self, _: Console, options: ConsoleOptions) -> Iterator[Text]:
        """Yield the table as wide as there is room."""
        yield Text(self.within(options.max_width), no_wrap=True)


_GAP: Final = 2


def _widths(rows: Sequence[Sequence[str]]) -> list[int]:
    return [max(map(len, column)) for column in zip(*rows, strict=True)]


def _total(widths: Sequence[int]) -> int:
    return sum(widths) + _GAP * (len(widths) - 1)


def _aligned(rows: Sequence[Sequence[str]], left: Sequence[str]) -> list[str]:
    return ["<" if i == 0 or title in left else ">" for i, title in enumerate(rows[0])]


def _columns(rows: Sequence[Sequence[str]], aligned: Sequence[str]) -> list[str]:
    shape = [f"{side}{width}" for side, width in zip(aligned, _widths(rows), strict=True)]
    return [(" " * _GAP).join(map(format, row, shape)).rstrip() for row in rows]


def _folded_label(row: Sequence[str], width: int) -> list[list[str]]:
    """Split a row whose label needs several lines into several rows; the last has the figures."""
    labels = fold(row[0], width).split("\n")
    return [*([label, *[""] * (len(row) - 1)] for label in labels[:-1]), [labels[-1], *row[1:]]]


def width_of(stream: IO[str]) -> int | None:
    """Return the columns of a stream's terminal; None for a pipe or a file."""
    if not stream.isatty():
        return None
    with suppress(KeyError, ValueError):
        return int(os.environ["COLUMNS"])
    return os.get_terminal_size(stream.fileno()).columns or _ORDINARY


_ORDINARY: Final = 80
"""Width of a terminal that does not report its width."""
_NO_LIMIT: Final = 10_000


class _Terminal(Console):
    """A console on which only styles and bars control the terminal, never text."""

    def __init__(self, *, stderr: bool) -> None:
        super().__init__(stderr=stderr, highlight=False, emoji=False, markup=False)
        if width_of(self.file) is None:
            self.width = _NO_LIMIT

    def say(self, text: str | Text) -> None:
        """Write a text or table, broken between words if this is a terminal."""
        width = width_of(self.file)
        if isinstance(text, TableText):
            text = text.within(width)
        if isinstance(text, str):
            text = Text(printable(text))
        self.print(_folded(text, width), soft_wrap=True)

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

    def say(self, *lines: str | Text) -> None:
        """Write lines for people."""
        for line in lines:
            self.text.say(line)

    def note(self, text: str) -> None:
        """Write a line about the present work to standard error."""
        self.notes.say(Text(printable(text), "dim"))

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
        """Show the present work immediately, and report while the block runs that it continues.

        `quick` work is shown immediately only on a terminal, where it is erased at the end.
        """
        if not quick and not self.notes.is_interactive and procedure_token is None:
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
        elif procedure_token is not None:
            with _written_as_json(advance):
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


@contextmanager
def _written_as_json(advance: Advance) -> Iterator[None]:
    written_s = -math.inf

    def write(share: float | None) -> None:
        print(to_json({"progress": {"what": advance.what, "share": share}}), flush=True)

    def write_now_and_then() -> None:
        nonlocal written_s
        if (now_s := time.monotonic()) - written_s >= _PROGRESS_S:
            written_s = now_s
            write(min(advance.done / advance.total, 1.0) if advance.total else None)

    advance.on_change = write_now_and_then
    write(0.0 if advance.total else None)
    yield
    write(1.0)


class Advance:
    """Progress of work; call it with the seconds of bus time that have passed."""

    def __init__(self, what: str, total: float | None) -> None:
        self.what, self.total, self.done = what, total, 0.0
        self.on_change: Callable[[], None] = lambda: None
        self._begun_s = time.monotonic()

    def __call__(self, time_s: float) -> None:
        """Set the progress to `time_s` seconds; 0 marks the start of the work after any wait."""
        if not time_s:
            self._begun_s = time.monotonic()
        self.done = time_s
        self.on_change()

    def text(self) -> str:
        """Return the progress as text, and the estimated remaining time."""
        elapsed_s = time.monotonic() - self._begun_s
        if not self.total:
            return f"{self.what}: running for {elapsed_s:.0f} s"
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
