"""A ready simulator prints JSON for programs and readable lines on a terminal."""

from __future__ import annotations

import io
import json
import os
import pty
from contextlib import redirect_stdout, suppress

from cdpr_sim_bus.bus.server import print_ready

READY = {"bus": "simbus:lab", "pid": 7, "mode": "lockstep", "nodes": [1, 2], "slcan": "/dev/pts/3"}


def test_output_to_a_pipe_is_one_line_of_json() -> None:
    out = io.StringIO()
    with redirect_stdout(out):
        print_ready(READY)
    assert json.loads(out.getvalue()) == {"ready": READY}
    assert out.getvalue().count("\n") == 1


def test_output_on_a_terminal_is_readable_lines() -> None:
    ours, theirs = pty.openpty()
    with os.fdopen(theirs, "w") as terminal, redirect_stdout(terminal):
        print_ready(READY)
        print_ready({"robot": "r", "pid": 7, "buses": {"a": READY, "b": {"bus": "simbus:b"}}})
    text = b""
    with suppress(OSError):  # end of file on a terminal
        while part := os.read(ours, 4096):
            text += part
    os.close(ours)
    shown = text.decode().splitlines()
    one = ["bus", "simbus:lab", "mode", "lockstep", "nodes", "1,", "2", "slcan", "/dev/pts/3"]
    assert " ".join(shown[:4]).split() == one
    assert shown[4] == "running; Ctrl-C ends it"
    assert shown[5].split() == ["robot", "r"]
    assert shown[10].split() == ["bus", "simbus:b"]
