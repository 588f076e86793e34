"""Small commands as a user types them: those that work in a process of their own, the rest here."""

from __future__ import annotations

import json
import os
import re
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from importlib.metadata import version
from pathlib import Path
from typing import Any

import can
import pytest
from cdpr_here import cdpr_here

from cdpr_profiles.reading.places import KINDS

WINCH = "winch-mpp0923d"
OWN = ("--bus", "simbus:")
Result = subprocess.CompletedProcess[str]


def cdpr(*arguments: str | Path) -> Result:
    command = [sys.executable, "-m", "cdpr_tools.cli", *map(str, arguments)]
    return subprocess.run(command, capture_output=True, text=True, timeout=120, check=False)


def done(*arguments: str | Path) -> dict[str, Any]:
    """Run a command with --json that has to succeed; return its last line."""
    result = cdpr(*arguments, "--json")
    assert result.returncode == 0, result.stderr
    told = json.loads(result.stdout.splitlines()[-1])
    assert told["ok"] is True
    return dict(told)


def refused(status: int, *arguments: str | Path, stdin: str = "") -> str:
    """Run a command that has to fail; return its one line of complaint."""
    result = cdpr_here(*arguments, stdin=stdin)
    assert result.returncode == status, result.stderr
    assert "Traceback" not in result.stderr
    lines = [line for line in result.stderr.splitlines() if "cdpr: " in line]
    assert len(lines) == 1, result.stderr
    assert result.stderr.rstrip().endswith(lines[0])
    return lines[0].partition("cdpr: ")[2]


def usage_error(*arguments: str) -> str:
    """Run a command with wrong arguments; return what it says, without the frame around it."""
    result = cdpr_here(*arguments)
    assert result.returncode == 2, result.stderr
    assert result.stdout == ""
    assert "Traceback" not in result.stderr
    return re.sub(r"[\s│╭╮╰╯─]+", " ", result.stderr)


@pytest.fixture(scope="module")
def lab() -> Iterator[str]:
    """A simulated drive that several commands find on a bus of its own name."""
    bus = f"simbus:cli-{os.getpid()}"
    arguments = ["sim", "up", WINCH, "--bus", bus, "--exit-with-stdin"]
    process = subprocess.Popen(
        [sys.executable, "-m", "cdpr_tools.cli", *arguments],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
    )
    assert process.stdout is not None
    assert bus in process.stdout.readline()
    yield bus
    process.communicate("", timeout=120)
    assert process.returncode == 0


# -- what needs no bus


def test_help_names_every_command() -> None:
    result = cdpr("--help")
    assert result.returncode == 0
    for name in ("bench", "bus", "cogging", "commission", "doctor", "drive", "profiles", "sim"):
        assert re.search(rf"^│ {name} ", result.stdout, re.MULTILINE), name


@pytest.mark.parametrize(
    ("command", "told"),
    [
        (("commission",), ("--plant", "--out", "--bandwidth-hz", "--quick", "--yes", "--json")),
        (("cogging",), ("sweep", "fit", "validate", "report")),
        (("drive",), ("info", "enable", "home", "jog", "od")),
        (("sim", "up"), ("--lockstep", "--paced", "--plant")),
        (("doctor",), ("--json",)),
    ],
    ids=lambda value: " ".join(value) if isinstance(value, tuple) else value,
)
def test_help_of_a_command(command: tuple[str, ...], told: tuple[str, ...]) -> None:
    result = cdpr_here(*command, "--help")
    assert result.returncode == 0
    for word in told:
        assert word in result.stdout


def test_profiles_are_listed_by_kind() -> None:
    told = done("profiles", "list")
    assert WINCH in told["winches"]
    assert {"MPP0923D", "MPJ0921B", "MPP2708N"} <= set(told["motors"])
    assert set(told) == {"ok", *KINDS}
    assert "spatial-8" in told["robots"]


def test_profile_is_shown_for_people_and_for_programs() -> None:
    told = done("profiles", "show", "MPP0923D")
    assert told["kind"] == "motors"
    assert told["profile"]["torque_constant_Nm_per_Arms"] == 0.561
    text = cdpr_here("profiles", "show", "MPP0923D").stdout
    assert "torque_constant_Nm_per_Arms = 0.561" in text
    assert done("profiles", "show", WINCH)["profile"]["motor"]["model"] == "MPP0923D"


def test_doctor_judges_this_machine() -> None:
    told = done("doctor")
    findings = {finding["what"]: finding for finding in told["findings"]}
    assert findings["embedded bus"]["level"] == "ok"
    assert all(f["remedy"] for f in told["findings"] if f["level"] != "ok")


# -- one drive


def test_info_of_an_own_simulated_drive() -> None:
    told = done("drive", "info", WINCH, *OWN)
    assert told["profile_fits"] is True
    assert told["state"] == "switch on disabled"
    assert told["rated_torque_Nm"] == 3.0
    assert told["encoder_counts_per_turn"] == 8192
    assert "10 (cyclic torque)" in told["supported_modes"]


def test_own_drive_is_that_of_the_plant_file(tmp_path: Path) -> None:
    plant = tmp_path / "fine.toml"
    plant.write_text("[encoder]\ncounts_per_turn = 20000\n")
    told = done("drive", "info", WINCH, *OWN, "--plant", plant)
    assert told["encoder_counts_per_turn"] == 20000


def test_enable_ends_without_power(lab: str) -> None:
    assert done("drive", "enable", WINCH, "--bus", lab)["state"] == "switch on disabled"
    assert done("drive", "info", WINCH, "--bus", lab)["state"] == "switch on disabled"


def test_home_finds_the_index() -> None:
    told = done("drive", "home", WINCH, *OWN, "--method", "34")
    assert told["method"] == 34
    assert abs(told["position_deg"]) < 10  # the drive stops past the index


@pytest.mark.parametrize("speed", [20.0, -90.0])
def test_jog_turns_by_speed_times_time(speed: float) -> None:
    told = done("drive", "jog", WINCH, *OWN, "--speed-deg-s", str(speed), "--seconds", "4")
    assert told["moved_deg"] == pytest.approx(4.0 * speed, abs=1.0)


def test_objects_are_read_and_written(lab: str) -> None:
    assert done("drive", "od", WINCH, "1018:2", "--bus", lab)["value"] == 0x402
    assert done("drive", "od", WINCH, "6072", "--set", "0x1F4", "--bus", lab)["value"] == 500
    assert done("drive", "od", WINCH, "6072", "--bus", lab)["value"] == 500


def _is_enabled(frame: can.Message | None) -> bool:
    """Return whether the frame is the drive's first TPDO, in operation enabled."""
    return frame is not None and frame.arbitration_id == 0x181 and frame.data[0] & 0x6F == 0x27


def test_ctrl_c_ends_a_jog_under_control(lab: str) -> None:
    command = [sys.executable, "-m", "cdpr_tools.cli", "drive", "jog", WINCH, "--bus", lab]
    process = subprocess.Popen(
        [*command, "--seconds", "600", "--speed-deg-s", "90"],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    with can.Bus(interface="simbus", channel=lab.partition(":")[2]) as listener:
        while not _is_enabled(listener.recv(1.0)):
            assert process.poll() is None
    process.send_signal(signal.SIGINT)
    _, errors = process.communicate(timeout=300)
    assert process.returncode == 1
    assert "stopped on request" in errors
    assert "Traceback" not in errors
    assert done("drive", "info", WINCH, "--bus", lab)["state"] == "switch on disabled"


def test_ctrl_c_over_and_over_takes_the_power_at_once_and_is_confirmed(lab: str) -> None:
    command = [sys.executable, "-m", "cdpr_tools.cli", "drive", "jog", WINCH, "--bus", lab]
    process = subprocess.Popen(
        [*command, "--seconds", "600", "--speed-deg-s", "90"],
        stderr=subprocess.PIPE,
        text=True,
        # the interpreter is to take itself apart while more come
        env={**os.environ, "CDPR_TEST_FORKS": "0"},
    )
    with can.Bus(interface="simbus", channel=lab.partition(":")[2]) as listener:
        while not _is_enabled(listener.recv(1.0)):
            assert process.poll() is None
    assert process.stderr is not None
    process.send_signal(signal.SIGINT)
    while "a second Ctrl-C takes the power at once" not in (line := process.stderr.readline()):
        assert line
    for _ in range(10):  # as somebody does who is afraid
        process.send_signal(signal.SIGINT)
        time.sleep(0.002)
    _, errors = process.communicate(timeout=300)
    assert process.returncode == 1, errors
    assert "Traceback" not in errors
    assert done("drive", "info", WINCH, "--bus", lab)["state"] == "switch on disabled"


# -- bad input: one line that says what is allowed, status 2


def test_a_bus_name_in_use_is_refused(lab: str) -> None:
    message = refused(2, "sim", "up", WINCH, "--bus", lab)
    assert lab in message
    assert "in use" in message


@pytest.mark.parametrize(
    ("bus", "words"),
    [
        ("bogus:", ("unknown interface 'bogus'", "simbus:NAME")),
        ("simbus", ("colon", "simbus:NAME")),
        ("simbus:a b", ("simbus:a b", "letters, digits")),
        ("simbus:nobody-here", ("simbus:nobody-here", "cdpr sim up")),
        ("socketcan:no/such", ("'no/such'", "15 characters")),
        ("socketcand://host", ("socketcand://host:port/can0",)),
    ],
)
def test_bad_bus(bus: str, words: tuple[str, ...]) -> None:
    message = refused(2, "drive", "info", WINCH, "--bus", bus)
    for word in words:
        assert word in message


def test_misspelt_winch_gets_the_name_that_was_meant() -> None:
    assert f"did you mean '{WINCH}'?" in refused(2, "drive", "info", "winch-mpp0932d", *OWN)
    assert "cdpr profiles list" in refused(2, "profiles", "show", "nothing-of-the-kind")


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("[motor]\ninertia_kg_m2 = 11.5\n", ("motor.inertia_kg_m2", "11.5", "equal to 10")),
        ("[frictoin]\ncoulomb_Nm = 0.1\n", ("frictoin", "friction")),
        ("[encoder]\ncounts_per_tum = 8192\n", ("counts_per_tum", "counts_per_turn")),
        ("[encoder]\ncounts_per_turn = 8192.5\n", ("counts_per_turn", "8192.5")),
        ('[[cogging]]\nkind = "magnetic"\n', ("kind", "magnetic", "current_offset")),
        ("[motor\n", ("line 1",)),
    ],
    ids=["range", "section", "key", "type", "choice", "syntax"],
)
def test_bad_plant_file(tmp_path: Path, text: str, words: tuple[str, ...]) -> None:
    plant = tmp_path / "plant.toml"
    plant.write_text(text)
    message = refused(2, "drive", "info", WINCH, *OWN, "--plant", plant)
    assert str(plant) in message
    for word in words:
        assert word in message


def test_plant_file_is_for_an_own_simulator_only(lab: str, tmp_path: Path) -> None:
    plant = tmp_path / "plant.toml"
    plant.touch()
    assert "simbus:" in refused(2, "drive", "info", WINCH, "--bus", lab, "--plant", plant)
    assert str(tmp_path / "none.toml") in refused(
        2, "drive", "info", WINCH, *OWN, "--plant", tmp_path / "none.toml"
    )


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("od", WINCH, "60zz"), ("60zz", "hexadecimal")),
        (("od", WINCH, "6072", "--set", "many"), ("--set many", "integer")),
        (("home", WINCH, "--method", "77"), ("--method 77", "33, 34")),
        (("jog", WINCH, "--speed-deg-s", "nan"), ("--speed-deg-s nan", "deg/s")),
        (("jog", WINCH, "--speed-deg-s", "1e9"), ("--speed-deg-s 1e+09", "deg/s")),
    ],
    ids=lambda value: " ".join(value[2:]) if isinstance(value, tuple) else value,
)
def test_bad_argument_of_drive(arguments: tuple[str, ...], words: tuple[str, ...]) -> None:
    message = refused(2, "drive", *arguments, *OWN)
    for word in words:
        assert word in message


def test_bad_usage_is_explained() -> None:
    assert "'--bus'" in usage_error("drive", "info", WINCH)
    assert "'nonsense'" in usage_error("nonsense")
    assert "600" in usage_error("drive", "enable", WINCH, *OWN, "--seconds", "1000")
    assert "'--bandwidth-hz'" in usage_error("commission", WINCH, *OWN, "--bandwidth-hz", "0")


def test_what_a_drive_refuses_is_a_failure(lab: str) -> None:
    for entry, value, words in (
        ("1018:1", "4", ("1018h:1", "read only")),
        ("6072", "99999999999", ("6072h:0", "99999999999")),
        ("5FFF", "0", ("5FFFh:0", "EDS")),
    ):
        message = refused(1, "drive", "od", WINCH, entry, "--set", value, "--bus", lab)
        assert all(word in message for word in words)


def test_a_real_bus_is_not_energised_unasked() -> None:
    for answer in ("n\n", ""):
        message = refused(
            2, "drive", "enable", WINCH, "--bus", "socketcan:no-such-can", stdin=answer
        )
        assert "nothing was energised" in message
    assert "socketcan:no-such-can" in refused(
        2, "drive", "enable", WINCH, "--bus", "socketcan:no-such-can", "--yes"
    )


def test_files_that_are_not_there(tmp_path: Path) -> None:
    nothing = tmp_path / "nothing"
    assert str(nothing) in refused(2, "cogging", "fit", nothing)
    assert str(nothing / "run.json") in refused(2, "cogging", "report", nothing)
    missing = tmp_path / "missing.json"
    arguments = ("cogging", "validate", WINCH, missing, *OWN, "--out", tmp_path / "out")
    assert str(missing) in refused(2, *arguments)


def test_an_earlier_run_is_not_overwritten(tmp_path: Path) -> None:
    (tmp_path / "raw").mkdir()
    old = tmp_path / "raw" / "sweep-0.raw"
    old.write_bytes(b"precious")
    message = refused(2, "commission", WINCH, *OWN, "--out", tmp_path)
    assert "--overwrite" in message
    assert old.read_bytes() == b"precious"


def test_an_error_is_json_too() -> None:
    result = cdpr_here("drive", "info", "no-such-winch", *OWN, "--json")
    told = json.loads(result.stdout.splitlines()[-1])
    assert told["ok"] is False
    assert told["exit_status"] == result.returncode == 2
    assert told["error"] in result.stderr


def test_ctrl_c_while_a_command_is_loaded_is_no_traceback() -> None:
    code = (
        "import os, signal, sys; from cdpr_tools import cli, command_group;"
        "command_group.load = lambda module, name: os.kill(os.getpid(), signal.SIGINT);"
        "sys.argv = ['cdpr', 'run', '--json']; cli.main()"
    )
    told = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, timeout=60, check=False
    )
    assert (told.returncode, told.stderr) == (1, "cdpr: interrupted\n")
    assert json.loads(told.stdout)["error"] == "interrupted"


def test_the_version_is_that_of_the_package() -> None:
    told = cdpr_here("--version")
    assert (told.returncode, told.stdout) == (0, f"cdpr {version('cdpr-rt')}\n")


def test_a_shell_completes_commands_and_those_of_a_group() -> None:
    def completed(words: str, count: int) -> list[str]:
        asked = {"_CDPR_COMPLETE": "complete_bash", "COMP_WORDS": words, "COMP_CWORD": str(count)}
        done = subprocess.run(
            [Path(sys.executable).with_name("cdpr")],
            env=os.environ | asked,
            capture_output=True,
            text=True,
            check=False,
        )
        return done.stdout.split()

    assert completed("cdpr comm", 1) == ["commission"]
    assert completed("cdpr drive en", 2) == ["enable"]


@pytest.mark.parametrize(
    ("module", "words"),
    [("httpx", ["status"]), ("uvicorn", ["run", "planar-3", "--bus", "simbus:"])],
)
def test_a_part_that_is_not_installed_is_named(module: str, words: list[str]) -> None:
    code = (
        "import sys; from cdpr_tools.cli import main;"
        f"sys.modules.pop({module!r}, None); sys.argv = ['cdpr', *{words!r}];"
        "import importlib.abc, importlib.machinery\n"
        "find = importlib.machinery.PathFinder.find_spec\n"
        f"hidden = lambda name, *rest: None if name == {module!r} else find(name, *rest)\n"
        "importlib.machinery.PathFinder.find_spec = hidden\n"
        "main()"
    )
    ended = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, timeout=60, check=False
    )
    assert ended.returncode == 1
    assert ended.stderr == (
        f"cdpr: needs {module}, which comes with: pip install 'cdpr-rt[daemon]'\n"
    )
