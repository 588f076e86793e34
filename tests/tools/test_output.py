"""Progress is a bar on a terminal and occasional lines in a file or pipe."""

from __future__ import annotations

import io
import os
import pty
import time
from contextlib import redirect_stderr, redirect_stdout, suppress
from types import SimpleNamespace

import pytest
from rich.table import Table

from cdpr_tools import output
from cdpr_tools.output import Output, TableText, fold


def _work() -> None:
    with Output(as_json=False).progress("winding", 10.0) as advance:
        for second in range(11):
            advance(float(second))


def test_a_pipe_gets_neither_a_bar_nor_a_blank_line() -> None:
    errors = io.StringIO()
    with redirect_stderr(errors):
        _work()
    assert errors.getvalue() == ""


def test_progress_in_a_pipe_names_the_work_immediately(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(output, "_TELL_S", (3600.0, 3600.0))
    errors = io.StringIO()
    with redirect_stderr(errors), Output(as_json=True).stage("winding"):
        assert errors.getvalue() == "winding ...\n"
    assert errors.getvalue() == "winding ...\n"


def test_long_work_prints_progress_in_a_pipe(monkeypatch: pytest.MonkeyPatch) -> None:
    now_s = 10.0
    monkeypatch.setattr(output, "time", SimpleNamespace(monotonic=lambda: now_s))
    monkeypatch.setattr(output, "_TELL_S", (0.01, 0.01))
    out, errors = Output(as_json=True), io.StringIO()

    def until(text: str) -> None:
        end_s = time.monotonic() + 60.0
        while text not in errors.getvalue():
            assert time.monotonic() < end_s, f"no {text!r} in {errors.getvalue()!r}"
            time.sleep(0.005)

    with redirect_stderr(errors):
        with out.stage("winding"):
            now_s += 7.0
            until("winding: running for 7 s")
        with out.progress("turns", 10.0) as advance:
            until("turns: 0 %")
            now_s += 40.0  # kernels are compiled before the motion
            advance(0.0)
            now_s += 3.0
            advance(5.0)
            until("turns: 50 %, about 3 s left")
        with out.progress("turning", 1e9) as advance:
            advance(1e-3)
            until("turning: 0 %")
    told = errors.getvalue()
    assert told.count("left") == told.count("50 %, about 3 s left")
    time.sleep(0.05)
    assert errors.getvalue() == told


def test_a_terminal_shows_a_bar(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("TERM", "xterm")
    ours, theirs = pty.openpty()
    with open(theirs, "w") as terminal, redirect_stderr(terminal):  # noqa: PTH123
        _work()
    shown = b""
    with suppress(OSError):  # end of output, when the other end of the terminal is closed
        while piece := os.read(ours, 65536):
            shown += piece
    assert b"winding" in shown
    os.close(ours)


ACTING = "\x1b]0;owned\x07 \x9b31m \x7f \u202etxt.exe \r \udc9b [red]"
SHOWN = "\\x1b]0;owned\\x07 \\x9b31m \\x7f \\u202etxt.exe \\r \\udc9b [red]"


@pytest.mark.parametrize("as_json", [False, True])
def test_control_characters_in_text_are_escaped(as_json: bool) -> None:
    told, noted = io.StringIO(), io.StringIO()
    with redirect_stdout(told), redirect_stderr(noted):
        out = Output(as_json)
        out.say(ACTING)
        out.note(ACTING)
        table = Table(ACTING, box=None)
        table.add_row(ACTING)
        out.text.print(table)
        with out.stage(ACTING):
            pass
    assert set("\x1b\x07\x9b\x7f\u202e\r\udc9b").isdisjoint(told.getvalue() + noted.getvalue())
    assert SHOWN in (noted if as_json else told).getvalue() and SHOWN in noted.getvalue()


PATH = "/home/someone/recordings/planar-3-20260101T000000Z-001.mcap"
FIGURES = TableText(
    [
        ["axis", "angle deg", "torque Nm", "tension N"],
        ["upper left", "-1311.13", "-1.470", "~56.8"],
        ["lower", "1545.73", "-0.951", "~36.9"],
    ]
)


def test_text_wraps_between_words_under_its_label() -> None:
    text = "loop       has a gain margin of 1.8 and a phase margin of 26 deg"
    assert fold(text, 40).splitlines() == [
        "loop       has a gain margin of 1.8 and",
        "           a phase margin of 26 deg",
    ]
    assert fold(text, None) == text


def test_paths_and_commands_to_copy_are_never_cut() -> None:
    assert f"{PATH}," in fold(f"recording {PATH}, 5.7 MB", 40).splitlines()
    assert "`cdpr tighten --from home`" in fold(
        "cables loose; next: `cdpr tighten --from home`", 40
    )
    again = "cdpr robot new my.toml --set 'frame_m=3 2' --yes"
    assert fold(f"nothing was written; again: {again}", 40).endswith(again)


def test_a_narrow_table_continues_below_with_its_labels() -> None:
    assert FIGURES.within(40).splitlines() == [
        "axis        angle deg  torque Nm",
        "upper left   -1311.13     -1.470",
        "lower         1545.73     -0.951",
        "",
        "axis        tension N",
        "upper left      ~56.8",
        "lower           ~36.9",
    ]
    assert len(FIGURES.within(80).splitlines()) == 3


def test_long_labels_of_a_table_wrap_before_columns_move() -> None:
    table = TableText([["", "value"], ["largest distance from the set-point on the way", "12.5"]])
    assert table.within(36).splitlines() == [
        "                           value",
        "largest distance from the",
        "set-point on the way        12.5",
    ]


def test_a_pipe_has_no_width(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("COLUMNS", "20")
    written = io.StringIO()
    with redirect_stdout(written):
        Output(as_json=False).say(f"recording {PATH}", FIGURES)
    assert written.getvalue() == f"recording {PATH}\n{FIGURES}\n"


def test_styles_still_reach_a_terminal(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("FORCE_COLOR", "1")
    noted = io.StringIO()
    with redirect_stderr(noted):
        Output(as_json=False).note("on \x1b[5m")
    assert noted.getvalue().startswith("\x1b[2m") and "on \\x1b[5m" in noted.getvalue()
