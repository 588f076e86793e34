"""`cdpr sim verify` confirms identical runs, finds differences, and leaves no process."""

from __future__ import annotations

import json
import random
import signal
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import pytest
from mcap.writer import Writer
from waiting import until

from cdpr_drivers.decode.candump import read_log
from cdpr_tools.repeat import Run, Stops, compare, processes_of

pytestmark = pytest.mark.long

SLOW_S = 60.0
DIFFERENT = """#!/bin/sh
# the drive's noise has another seed in each run
echo "seed = $(cat '{seeds}' | wc -l)" > plant.toml
echo >> '{seeds}'
cdpr drive jog winch-mpp0923d --bus simbus: --plant plant.toml --seconds 0.2
"""
JOG = ("drive", "jog", "winch-mpp0923d", "--bus", "simbus:", "--seconds", "0.2")


def cdpr(*arguments: str | Path) -> list[str]:
    return [sys.executable, "-m", "cdpr_tools.cli", *map(str, arguments)]


def verified(*arguments: str | Path, status: int) -> dict[str, Any]:
    command = cdpr("sim", "verify", "--json", *arguments)
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == status, done.stderr
    result: dict[str, Any] = json.loads(done.stdout.splitlines()[-1])
    return result


def test_a_motion_is_identical_beside_busy_and_with_stopped_processes(tmp_path: Path) -> None:
    keep = tmp_path / "kept"
    options = ("--seed", "3", "--busy", "1", "--keep", keep)
    told = verified(*options, "--", *JOG, status=0)
    assert told["ok"] and told["seed"] == 3
    assert told["runs"][0]["stops"] == 0 < told["runs"][1]["stops"]
    (file,) = told["files"]
    assert file["file"] == "frames.log" and file["same"] and len(set(file["hashes"])) == 1
    with (keep / "run-2" / "files" / "frames.log").open() as lines:
        frames = [one.frame for one in read_log("frames.log", lines)]
    assert sum(frame.can_id == 0x080 for frame in frames) > 200
    assert (keep / "run-1" / "output.txt").read_text()
    assert processes_of(keep / "run-2" / "files") == []
    refused = verified("--keep", keep, "--", *JOG, status=2)
    assert "kept: cannot be created: File exists" in refused["error"]


def test_a_drive_with_different_noise_is_found(tmp_path: Path) -> None:
    script = tmp_path / "different.sh"
    (tmp_path / "seeds").write_text("")
    script.write_text(DIFFERENT.format(seeds=tmp_path / "seeds"))
    script.chmod(0o755)
    told = verified("--busy", "0", "--", script, status=1)
    assert not told["ok"]
    found = {file["file"]: file for file in told["files"]}
    assert found["frames.log"]["same"] is False
    assert found["frames.log"]["difference"].startswith("runs 1 and 2: line ")
    assert " can0 181#" in found["frames.log"]["difference"]
    assert found["plant.toml"]["difference"] == "runs 1 and 2: seed: 0 | 1"


def test_a_command_that_fails_or_writes_nothing_is_an_error(tmp_path: Path) -> None:
    told = verified("--", "drive", "jog", "no-such-winch", "--bus", "simbus:", status=2)
    assert "run 1 ended with exit status 2: " in told["error"]
    assert "no-such-winch" in told["error"]
    told = verified("--", "no-such-command", status=2)
    assert "ended with exit status 2: No such command 'no-such-command'" in told["error"]
    told = verified("--busy", "0", "--", "/bin/true", status=1)
    assert told["error"] == "the command wrote no file that can be compared"
    told = verified("--", tmp_path / "missing", status=2)
    assert told["error"] == f"{tmp_path}/missing: cannot be run: No such file or directory"


def test_ctrl_c_leaves_no_process(tmp_path: Path) -> None:
    keep = tmp_path / "kept"
    script = tmp_path / "sleeps.sh"
    left = f"trap 'echo asked > asked' TERM; sleep {SLOW_S} & echo begun > begun; wait"
    script.write_text(f"#!/bin/sh\n({left}) & wait\n")
    script.chmod(0o755)
    process = subprocess.Popen(
        cdpr("sim", "verify", "--keep", keep, "--", script), stderr=subprocess.PIPE, text=True
    )
    work = keep / "run-1" / "files"
    until((work / "begun").exists)
    until(lambda: len(processes_of(work)) == 3)  # a shell, its child and the sleep
    process.send_signal(signal.SIGINT)
    _, told = process.communicate(timeout=SLOW_S)
    assert process.returncode == 1 and "cdpr: stopped on request, in run 1" in told
    assert processes_of(work) == []
    assert (work / "asked").exists()  # processes of the command are asked to end and not killed


def test_processes_are_stopped_one_at_a_time_and_continue() -> None:
    sleeping = [subprocess.Popen(["sleep", "60"]) for _ in range(3)]

    def stopped() -> int:
        texts = [Path(f"/proc/{one.pid}/stat").read_text() for one in sleeping]
        return sum(text.rsplit(")", 1)[1].split()[0] == "T" for text in texts)

    stops, began = Stops(random.Random(2)), time.monotonic()
    most, some = 0, [one.pid for one in sleeping]
    try:
        while stops.number < 3:
            stops.turn([*some, 2**22 + 1])  # a process that has ended meanwhile
            most = max(most, stopped())
            time.sleep(0.005)
        assert most == 1 and 0.1 < stops.held_s < time.monotonic() - began
        stops.release()
        until(lambda: stopped() == 0)
    finally:
        for one in sleeping:
            one.kill()
            one.wait()


def made_runs(folder: Path, *processes: int) -> list[Run]:
    runs = []
    for number, process in enumerate(processes, 1):
        work = folder / f"run-{number}" / "files"
        work.mkdir(parents=True)
        known = frozenset({process})
        runs.append(Run(number, work, work, 0, 1.0, known, 0, 0.0))
    return runs


def differences(runs: list[Run]) -> dict[str, str | None]:
    return {one.file: None if one.same is None else one.difference for one in compare(runs)}


def test_names_and_times_specific_to_a_run_are_ignored(tmp_path: Path) -> None:
    runs = made_runs(tmp_path, 4711, 815)
    for run, name, date in zip(
        runs, ("x-20261122T100000Z-001", "x-20261122T100907Z-001"), ("now", "later"), strict=True
    ):
        (process,) = run.processes
        (run.folder / f"{name}.raw").write_bytes(b"same")
        (run.folder / f"sim-{process}.raw").write_bytes(b"same")
        told = {"date": date, "inner": [{"wall_s": process, "bus": f"simbus:own-{process}"}]}
        told |= {"file": str(run.folder / f"{name}.raw"), "value": 1.5}
        (run.folder / "run.json").write_text(json.dumps(told))
        (run.folder / "run.toml").write_text(f"date = {2000 + process}-01-01\nvalue = 1\n")
        (run.folder / "report.html").write_text(date)
    assert differences(runs) == {
        "x-DATE-001.raw": "",
        "sim-PID.raw": "",
        "run.json": "",
        "run.toml": "",
        "report.html": None,
    }


def test_the_first_difference_is_reported(tmp_path: Path) -> None:
    runs = made_runs(tmp_path, 1, 2, 3)
    for run in runs:
        last = run.number == 3
        (run.folder / "sweep.raw").write_bytes(bytes(70_000) + bytes([last, 7]))
        (run.folder / "short.raw").write_bytes(bytes(100 + last))
        value = {"a": {"b": [1.0, 1.0 + last]}, "date": "x"}
        (run.folder / "run.json").write_text(json.dumps(value))
        (run.folder / "frames.log").write_text("(0.0) can0 080#\n" * (5 - last))
    (runs[1].folder / "more.json").write_text("{}")
    (runs[0].folder / "bad.json").write_text("{")
    assert differences(runs) == {
        "sweep.raw": "runs 1 and 3: byte 70000",
        "short.raw": "runs 1 and 3: byte 100",
        "run.json": "runs 1 and 3: a.b[1]: 1.0 | 2.0",
        "frames.log": "runs 1 and 3: line 5: the second file has already ended",
        "more.json": "run 1 did not write it",
        "bad.json": "in run 1: cannot be read: Expecting property name enclosed in double quotes: "
        "line 1 column 2 (char 1)",
    }


def recording(path: Path, log_time: int, torque: float, events: int) -> None:
    with path.open("wb") as file:
        writer = Writer(file)
        writer.start(profile="cdpr-rt")
        schema = writer.register_schema("any", "jsonschema", b"{}")
        ids = {
            topic: writer.register_channel(topic, "json", schema)
            for topic in ("/cycle", "/timing", "/events")
        }
        for k in range(5):
            row = {"cycle": k, "torque_sent_Nm": [0.0, torque * (k == 3)]}
            timing = {"cycle": k, "stamp_ns": log_time + k}
            for topic, value in (("/timing", timing), ("/cycle", row)):
                writer.add_message(ids[topic], log_time + k, json.dumps(value).encode(), log_time)
        for k in range(events):
            writer.add_message(ids["/events"], log_time, b'{"text": "%d"}' % k, log_time)
        writer.finish()  # type: ignore[no-untyped-call]


@pytest.mark.parametrize(
    ("torque", "events", "wanted"),
    [
        (0.0, 2, ""),
        (0.5, 2, "runs 1 and 2: /cycle, message 4: torque_sent_Nm[1]: 0.0 | 0.5"),
        (0.0, 1, "runs 1 and 2: /events, message 2: the second file has already ended"),
    ],
)
def test_recordings_are_compared_without_wall_clock_times(
    tmp_path: Path, torque: float, events: int, wanted: str
) -> None:
    runs = made_runs(tmp_path, 1, 2)
    recording(runs[0].folder / "r.mcap", 1_000, 0.0, 2)
    recording(runs[1].folder / "r.mcap", 9_000, torque, events)
    assert differences(runs) == {"r.mcap": wanted}
