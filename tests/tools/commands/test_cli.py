"""Small commands as a user types them, in this process or in separate ones."""

from __future__ import annotations

import os
import re
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from itertools import pairwise
from pathlib import Path
from typing import Any

import can
import pytest
import typer
from cdpr_here import cdpr_here
from typer.core import TyperArgument

from cdpr_profiles.places import KINDS
from cdpr_tools.cli import ALIASES, GUESSES, MODULES, PANELS, STOPS, app
from tests.tools.commands.cli_rig import OWN, WINCH, cdpr, done, refused


@pytest.fixture(scope="module")
def lab() -> Iterator[str]:
    """Yield the bus of a simulated drive that several commands use."""
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


# -- commands without a bus


def test_help_lists_each_command_but_bench_under_a_heading() -> None:
    result = cdpr("--help")
    assert result.returncode == 0
    shown = [name for names in PANELS.values() for name in names]
    assert sorted([*shown, "bench"]) == sorted(name for some in MODULES.values() for name in some)
    assert re.findall(r"^│ ([a-z][a-z-]*) ", result.stdout, re.MULTILINE) == shown


@pytest.mark.parametrize(
    ("typed", "answer"),
    [
        ("robt", "No such command 'robt'; did you mean 'robot'?"),
        ("hld", "No such command 'hld'; see `cdpr --help`"),
        ("enabel", "No such command 'enabel'; see `cdpr --help`"),
        ("mov", "No such command 'mov'; see `cdpr --help`"),
        ("calibrat", "No such command 'calibrat'; see `cdpr --help`"),
    ],
)
def test_a_typo_suggests_no_command_that_moves_or_switches_power(typed: str, answer: str) -> None:
    result = cdpr_here(typed)
    assert result.returncode == 2
    assert result.stderr == f"cdpr: {answer}\n"


@pytest.mark.parametrize("alias", ALIASES)
def test_an_alias_names_the_command_and_runs_it(alias: str) -> None:
    result = cdpr_here(*alias.split(), "--help")
    assert result.returncode == 0
    assert result.stderr == f"this is `cdpr {ALIASES[alias]}`\n"
    words = ALIASES[alias].removesuffix(" robots")
    assert f"Usage: cdpr {words} [" in result.stdout


@pytest.mark.parametrize("guess", GUESSES)
def test_a_guess_that_would_move_is_not_carried_out(guess: str) -> None:
    result = cdpr_here(guess, "300", "2000")
    assert result.returncode == 2
    assert result.stderr == f"cdpr: {guess}: {GUESSES[guess]}\n"


def test_no_alias_leads_to_a_command_that_moves_or_cuts_power() -> None:
    moving = {*PANELS["Move"], *PANELS["Stop"], "enable", "drive", "rail", "commission"} - {"hold"}
    assert moving.isdisjoint(command.split()[0] for command in ALIASES.values())


def test_stop_commands_end_their_help_with_the_comparison_of_the_page() -> None:
    page = (Path(__file__).parents[3] / "docs/how-to/which-stop.md").read_text()
    for name in PANELS["Stop"]:
        assert "Which stop do I want?" in cdpr_here(name, "--help").stdout
        assert f"\n{name} " in STOPS and f"`cdpr {name}`" in page


def test_a_robot_is_named_by_argument_option_or_environment(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path))  # without the daemons of this machine
    named = (("planar-3",), ("--robot", "planar-3"), ("--robot=planar-3",))
    told = [cdpr_here("bus", "budget", *words).stdout for words in named]
    assert "3 cables" in told[0]
    assert told[1:] == told[:1] * 2
    missing = cdpr_here("bus", "budget")
    assert "Name it, or set CDPR_ROBOT" in missing.stderr
    monkeypatch.setenv("CDPR_ROBOT", "planar-3")
    assert cdpr_here("bus", "budget").stdout == told[0]
    # before another argument
    assert (
        "simbus:x-can0: no simulated bus"
        in cdpr_here("sim", "fault", "slip", "--bus", "simbus:x").stderr
    )
    assert "for planar-3 (from CDPR_ROBOT)" in cdpr_here("hold").stderr
    assert "for planar-4;" in cdpr_here("hold", "--robot", "planar-4").stderr
    assert "CDPR_ROBOT" not in cdpr_here("hold", "--socket", "/none").stderr


def _commands(group: Any, words: tuple[str, ...] = ()) -> Iterator[tuple[str, Any]]:
    """Yield all commands below a group with their words."""
    if not hasattr(group, "list_commands"):
        yield " ".join(words), group
        return
    context = typer.Context(group)
    for name in group.list_commands(context):
        _, command, _ = group.resolve_command(context, [name])
        yield from _commands(command, (*words, name))


def test_each_option_and_argument_has_a_help_text() -> None:
    commands = dict(_commands(typer.main.get_group(app)))
    assert "robot trial" in commands and len(commands) > 80
    unexplained = [
        f"{name}: {param.name}"
        for name, command in commands.items()
        for param in command.params
        if not (param.help or "").strip()
    ]
    assert unexplained == []
    for name, command in commands.items():
        for param in command.params:
            if isinstance(param, TyperArgument):
                assert param.metavar, f"{name}: {param.name}"
                assert param.metavar == param.metavar.upper(), f"{name}: {param.metavar}"


def test_help_shows_no_type_of_flags_and_arguments() -> None:
    told = cdpr_here("robot", "trial", "--help").stdout
    assert re.search(r"--json +End with one JSON line", told)
    assert re.search(r"ROBOT +Robot profile", told)
    assert re.search(r"--seed +N +Random seed. \(0 or more\)", told)


def test_help_paragraphs_use_the_width_of_the_terminal(monkeypatch: pytest.MonkeyPatch) -> None:
    for columns in (80, 140):
        monkeypatch.setenv("COLUMNS", str(columns))
        told = cdpr("robot", "new", "--help").stdout.partition("It describes")[2].partition("╭")[0]
        lines = [line.strip() for line in f"It describes{told}".strip().splitlines()]
        assert len(lines) > 1
        for line, after in pairwise(lines):
            assert len(line) + len(f" {after.split()[0]}") > columns - 4, line


def test_profiles_are_listed_by_kind() -> None:
    told = done("profiles", "list")
    assert WINCH in told["winches"]
    assert {"MPP0923D", "MPJ0921B", "MPP2708N"} <= set(told["motors"])
    assert set(told) == {"ok", *KINDS}
    assert "spatial-8" in told["robots"]


def test_a_profile_is_shown_as_text_or_json() -> None:
    told = done("profiles", "show", "MPP0923D")
    assert told["kind"] == "motors"
    assert told["profile"]["torque_constant_Nm_per_Arms"] == 0.561
    text = cdpr_here("profiles", "show", "MPP0923D").stdout
    assert "torque_constant_Nm_per_Arms = 0.561" in text
    assert done("profiles", "show", WINCH)["profile"]["motor"]["model"] == "MPP0923D"


def test_doctor_checks_this_machine() -> None:
    told = done("doctor")
    findings = {finding["what"]: finding for finding in told["findings"]}
    assert findings["embedded bus"]["level"] == "ok"
    assert all(f["remedy"] for f in told["findings"] if f["level"] != "ok")


# -- one drive


def test_info_starts_a_simulated_drive() -> None:
    told = done("drive", "info", WINCH, *OWN)
    assert told["profile_fits"] is True
    assert told["state"] == "switch on disabled"
    assert told["rated_torque_Nm"] == 3.0
    assert told["encoder_counts_per_turn"] == 8192
    assert "10 (cyclic torque)" in told["supported_modes"]


def test_a_drive_started_by_a_command_uses_the_plant_file(tmp_path: Path) -> None:
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
    assert abs(told["position_deg"]) < 10  # the drive stops beyond the index


@pytest.mark.parametrize(("speed", "seconds"), [(20.0, 3.0), (-90.0, 4.0), (360.0, 2.0)])
def test_jog_turns_by_speed_times_time(speed: float, seconds: float) -> None:
    options = ("--speed-deg-s", str(speed), "--seconds", str(seconds))
    told = done("drive", "jog", WINCH, *OWN, *options)
    assert told["moved_deg"] == pytest.approx(seconds * speed, abs=1.0)


def test_objects_are_read_and_written(lab: str) -> None:
    assert done("drive", "od", WINCH, "1018:2", "--bus", lab)["value"] == 0x402
    assert done("drive", "od", WINCH, "6072", "--set", "0x1F4", "--bus", lab)["value"] == 500
    assert done("drive", "od", WINCH, "6072", "--bus", lab)["value"] == 500


def _is_enabled(frame: can.Message | None) -> bool:
    """Return whether a frame is the drive's first TPDO in operation enabled."""
    return frame is not None and frame.arbitration_id == 0x181 and frame.data[0] & 0x6F == 0x27


def test_ctrl_c_ends_a_jog_with_a_controlled_stop(lab: str) -> None:
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


def test_repeated_ctrl_c_cuts_power_immediately_and_confirms_it(lab: str) -> None:
    command = [sys.executable, "-m", "cdpr_tools.cli", "drive", "jog", WINCH, "--bus", lab]
    process = subprocess.Popen(
        [*command, "--seconds", "600", "--speed-deg-s", "90"],
        stderr=subprocess.PIPE,
        text=True,
        # more Ctrl-C arrive while the interpreter shuts down
        env={**os.environ, "CDPR_TEST_FORKS": "0"},
    )
    with can.Bus(interface="simbus", channel=lab.partition(":")[2]) as listener:
        while not _is_enabled(listener.recv(1.0)):
            assert process.poll() is None
    assert process.stderr is not None
    process.send_signal(signal.SIGINT)
    while "press Ctrl-C again to remove the power immediately" not in (
        line := process.stderr.readline()
    ):
        assert line
    for _ in range(10):  # as an alarmed user does
        process.send_signal(signal.SIGINT)
        time.sleep(0.002)
    _, errors = process.communicate(timeout=300)
    assert process.returncode == 1, errors
    assert "Traceback" not in errors
    assert done("drive", "info", WINCH, "--bus", lab)["state"] == "switch on disabled"


# -- invalid input: one line with the allowed values, status 2


def test_a_bus_name_in_use_is_rejected(lab: str) -> None:
    message = refused(2, "sim", "up", WINCH, "--bus", lab)
    assert lab in message
    assert "in use" in message


def test_a_plant_file_requires_a_simulator_of_the_command(lab: str, tmp_path: Path) -> None:
    plant = tmp_path / "plant.toml"
    plant.touch()
    assert "simbus:" in refused(2, "drive", "info", WINCH, "--bus", lab, "--plant", plant)
    assert str(tmp_path / "none.toml") in refused(
        2, "drive", "info", WINCH, *OWN, "--plant", tmp_path / "none.toml"
    )


def test_an_object_that_a_drive_rejects_is_an_error(lab: str) -> None:
    for entry, value, words in (
        ("1018:1", "4", ("1018h:1", "read only")),
        ("6072", "99999999999", ("6072h:0", "99999999999")),
        ("5FFF", "0", ("5FFFh:0", "EDS")),
    ):
        message = refused(1, "drive", "od", WINCH, entry, "--set", value, "--bus", lab)
        assert all(word in message for word in words)
