"""Commands whose output cannot be written: full disks, closed pipes, closed descriptors."""

from __future__ import annotations

import json
import os
import pty
import subprocess
import sys
from pathlib import Path

import pytest

CDPR = [sys.executable, "-P", "-m", "cdpr_tools.cli"]
FULL = Path("/dev/full")
NO_SPACE = "cdpr: standard output: cannot be written: No space left on device\n"
WRITES = """
import sys
from cdpr_tools.signals import stop_on_signals
from cdpr_tools.streams import guard_streams, outlive_output
guard_streams()
outlive_output()
print("ready", flush=True)
sys.stdin.read()
with stop_on_signals("a notice") as request:
    for _ in range(1000):
        print(1000 * "x", file=sys.stderr)
    request.note(2, None)
sys.exit(7)
"""


def cdpr(*words: str | Path) -> subprocess.CompletedProcess[str]:
    with FULL.open("w") as full:
        return subprocess.run(
            [*CDPR, *map(str, words)], stdout=full, stderr=subprocess.PIPE, text=True, check=False
        )


@pytest.fixture
def log(tmp_path: Path) -> Path:
    path = tmp_path / "candump.log"
    path.write_text("(1.000000) can0 701#05\n" * 100)
    return path


@pytest.mark.parametrize("words", [("profiles", "list"), ("--help",)])
def test_a_full_disk_is_reported_in_one_line_with_status_1(words: tuple[str, ...]) -> None:
    done = cdpr(*words)
    assert (done.returncode, done.stderr) == (1, NO_SPACE)


def test_a_full_disk_is_reported_by_a_command_that_writes_from_a_thread(log: Path) -> None:
    done = cdpr("bus", "replay", log)
    assert done.returncode == 1
    assert done.stderr.endswith(f"\n{NO_SPACE}") and "Traceback" not in done.stderr


def test_invalid_input_is_reported_although_its_json_cannot_be_written() -> None:
    done = cdpr("robot", "show", "nosuch", "--json")
    assert done.returncode == 2
    assert done.stderr.count("\n") == 1 and "'nosuch'" in done.stderr


def test_a_closed_pipe_ends_the_command_silently() -> None:
    reader, writer = os.pipe()
    os.close(reader)
    done = subprocess.run(
        [*CDPR, "profiles", "list"], stdout=writer, stderr=subprocess.PIPE, text=True, check=False
    )
    os.close(writer)
    assert (done.returncode, done.stderr) == (1, "")


def test_an_unwritable_standard_error_does_not_change_the_result() -> None:
    with FULL.open("w") as full:
        done = subprocess.run(
            [*CDPR, "robot", "show", "nosuch", "--json"],
            stdout=subprocess.PIPE, stderr=full, text=True, check=False,
        )  # fmt: skip
    assert done.returncode == 2
    assert json.loads(done.stdout)["exit_status"] == 2


def test_closed_standard_descriptors_are_not_reused_for_files(tmp_path: Path) -> None:
    script = (
        "from cdpr_tools.streams import guard_streams; guard_streams(); import os, sys;"
        "print('lost'); print('lost', file=sys.stderr);"
        f"sys.exit(os.open({str(tmp_path / 'file')!r}, os.O_CREAT))"
    )
    command = ["sh", "-c", 'exec "$@" <&- >&- 2>&-', "sh", sys.executable, "-c", script]
    assert subprocess.run(command, check=False, timeout=60).returncode > 2


@pytest.mark.parametrize("lost", ["reader", "terminal", "disk", "paused", "paused terminal"])
def test_a_notice_of_a_daemon_neither_raises_nor_blocks(lost: str) -> None:
    """Signal handlers write notices too."""
    ours, theirs = pty.openpty() if "terminal" in lost else os.pipe()
    if lost == "disk":
        theirs = os.open(FULL, os.O_WRONLY)
    process = subprocess.Popen(
        [sys.executable, "-c", WRITES],
        stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=theirs,
    )  # fmt: skip
    assert process.stdout is not None and process.stdin is not None
    assert process.stdout.readline() == b"ready\n"
    if "paused" not in lost:
        os.close(ours)
    process.stdin.close()
    try:
        assert process.wait(60) == 7
    finally:
        process.kill()
        process.wait()
        process.stdout.close()


def test_a_notice_from_a_background_daemon_does_not_stop_it() -> None:
    """A terminal sends SIGTTOU after `stty tostop`."""
    script = (
        "from cdpr_tools.streams import guard_streams, outlive_output; import os, signal, sys;"
        "guard_streams(); outlive_output();"
        "sys.exit(7 if signal.getsignal(signal.SIGTTOU) is signal.SIG_IGN else 1)"
    )
    done = subprocess.run([sys.executable, "-c", script], check=False, timeout=60)
    assert done.returncode == 7
