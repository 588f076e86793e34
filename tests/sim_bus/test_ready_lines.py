"""What a simulator tells when it is up: JSON to programs, readable lines on a terminal."""

from __future__ import annotations

import io
import json
import os
import pty
from contextlib import redirect_stdout, suppress

from cdpr_sim_bus.bus.server import print_ready

READY = {"bus": "simbus:lab", "pid": 7, "mode": "lockstep", "nodes": [1, 2], "slcan": "/dev/pts/3"}


def test_a_program_gets_one_line_of_json() -> None:
    out = io.StringIO()
    with redirect_stdout(out):
        print_ready(READY)
    assert json.loads(out.getvalue()) == {"ready": READY}
    assert out.getvalue().count("\n") == 1


def test_a_terminal_gets_what_a_person_wants_to_know() -> None:
    ours, theirs = pty.openpty()
    with os.fdopen(theirs, "w") as terminal, redirect_stdout(terminal):
        print_ready(READY)
        print_ready({"robot": "r", "pid": 7, "buses": {"a": READY, "b": {"bus": "simbus:b"}}})
    text = b""
    with suppress(OSError):  # how the end of a terminal reads
        while part := os.read(ours, 4096):
            text += part
    os.close(ours)
    shown = text.decode().splitlines()
    one = ["bus", "simbus:lab", "mode", "lockstep", "nodes", "1,", "2", "slcan", "/dev/pts/3"]
    assert " ".join(shown[:4]).split() == one
    assert shown[4] == "up; Ctrl-C ends it"
    assert shown[5].split() == ["robot", "r"]
    assert shown[10].split() == ["bus", "simbus:b"]
