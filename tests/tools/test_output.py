"""Progress bars: drawn on a terminal, silent in a file or pipe."""

from __future__ import annotations

import io
import os
import pty
from contextlib import redirect_stderr, suppress

import pytest

from cdpr_tools.output import Output


def _work() -> None:
    with Output(as_json=False).progress("winding", 10.0) as advance:
        for second in range(11):
            advance(float(second))


def test_no_bar_and_no_blank_line_in_a_pipe() -> None:
    errors = io.StringIO()
    with redirect_stderr(errors):
        _work()
    assert errors.getvalue() == ""


def test_a_bar_on_a_terminal(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("TERM", "xterm")
    ours, theirs = pty.openpty()
    with open(theirs, "w") as terminal, redirect_stderr(terminal):  # noqa: PTH123
        _work()
    shown = b""
    with suppress(OSError):  # the end, where a terminal's other side is closed
        while piece := os.read(ours, 65536):
            shown += piece
    assert b"winding" in shown
    os.close(ours)
