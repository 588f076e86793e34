"""Invalid input: one line with the allowed values and status 2."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from importlib.metadata import version
from pathlib import Path

import pytest
from cdpr_here import cdpr_here

from cdpr_rt.identification.rawlog import RawLogWriter
from cdpr_tools.busview.monitor import LogFile
from cdpr_tools.commission.run import prepare
from cdpr_tools.errors import BadInputError
from tests.tools.commands.cli_rig import OWN, WINCH, refused, usage_error


@pytest.mark.parametrize(
    ("bus", "words"),
    [
        ("bogus:", ("unknown interface 'bogus'", "simbus:NAME")),
        ("simbus", ("colon", "simbus:NAME")),
        ("simbus:a b", ("simbus:a b", "letters, digits")),
        ("socketcan:no/such", ("'no/such'", "15 characters")),
        ("socketcand://host", ("socketcand://host:port/can0",)),
    ],
)
def test_an_invalid_bus_is_rejected(bus: str, words: tuple[str, ...]) -> None:
    message = refused(2, "drive", "info", WINCH, "--bus", bus)
    for word in words:
        assert word in message


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
def test_an_invalid_plant_file_is_rejected(
    tmp_path: Path, text: str, words: tuple[str, ...]
) -> None:
    plant = tmp_path / "plant.toml"
    plant.write_text(text)
    message = refused(2, "drive", "info", WINCH, *OWN, "--plant", plant)
    assert str(plant) in message
    for word in words:
        assert word in message


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("od", WINCH, "60zz"), ("60zz", "hexadecimal")),
        (("od", WINCH, "6072", "--set", "many"), ("--set many", "integer")),
        (("home", WINCH, "--method", "77"), ("--method 77", "33, 34")),
        (("jog", WINCH, "--speed-deg-s", "nan"), ("--speed-deg-s nan", "deg/s")),
    ],
    ids=lambda value: " ".join(value[2:]) if isinstance(value, tuple) else value,
)
def test_an_invalid_argument_of_drive_is_rejected(
    arguments: tuple[str, ...], words: tuple[str, ...]
) -> None:
    message = refused(2, "drive", *arguments, *OWN)
    for word in words:
        assert word in message


def test_usage_errors_are_explained() -> None:
    assert "'nonsense'" in usage_error("nonsense")
    assert "600" in usage_error("drive", "enable", WINCH, *OWN, "--seconds", "1000")
    assert "'--bandwidth-hz'" in usage_error("commission", WINCH, *OWN, "--bandwidth-hz", "0")


def test_power_on_a_real_bus_needs_a_confirmation() -> None:
    for answer in ("n\n", ""):
        message = refused(
            2, "drive", "enable", WINCH, "--bus", "socketcan:no-such-can", stdin=answer
        )
        assert "nothing was energised" in message
    assert "socketcan:no-such-can" in refused(
        2, "drive", "enable", WINCH, "--bus", "socketcan:no-such-can", "--yes"
    )


def test_missing_files_are_reported(tmp_path: Path) -> None:
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


def test_overwriting_an_earlier_run_keeps_other_files(tmp_path: Path) -> None:
    raw = tmp_path / "raw"
    raw.mkdir()
    RawLogWriter(raw / "sweep-0.raw", ["cycle"], {}).close()
    for path in (raw / "DSC_0001.raw", raw / "notes.txt", tmp_path / "thesis.tex"):
        path.write_text("precious")
    (tmp_path / "run.json").write_text("of the earlier run")
    prepare(tmp_path, overwrite=True)
    left = {str(path.relative_to(tmp_path)) for path in tmp_path.rglob("*") if path.is_file()}
    assert left == {"raw/DSC_0001.raw", "raw/notes.txt", "thesis.tex"}


@pytest.mark.parametrize(
    "words",
    [
        ("robot", "show", "planar-3", "--png"),
        ("robot", "workspace", "spatial-8", "--mesh"),
        ("poses", "planar-3", "--out"),
    ],
)
def test_an_existing_file_is_not_overwritten(words: tuple[str, ...], tmp_path: Path) -> None:
    endings = {"--png": ".png", "--mesh": ".stl", "--out": ".csv"}
    file = tmp_path / f"precious{endings[words[-1]]}"
    file.write_text("precious")
    assert "already exists" in refused(2, *words, file)
    with pytest.raises(BadInputError, match="already exists"):
        LogFile(file)
    assert file.read_text() == "precious"


def test_commission_rejects_a_folder_with_other_files(tmp_path: Path) -> None:
    (tmp_path / "thesis.tex").write_text("precious")
    message = refused(2, "commission", WINCH, *OWN, "--out", tmp_path)
    assert message.startswith(f"--out {tmp_path}: contains other files")
    assert [path.name for path in tmp_path.iterdir()] == ["thesis.tex"]


@pytest.mark.parametrize(
    ("words", "problem"),
    [
        (("robot", "show", "planar-3", "--png", "a.jpg"), "--png a.jpg: allowed: a name that ends"),
        (("poses", "planar-3", "--png", "a.pdf"), "--png a.pdf: allowed: a name that ends in .png"),
        (("markers", "print", "0", "--out", "a.png"), "--out a.png: allowed: a name that ends in"),
        (("markers", "map", "/nowhere"), "/nowhere: is not a folder with images"),
        (("profiles", "show", "nothing-of-the-kind"), "cdpr profiles list"),
        *(
            (("run", "planar-3", *OWN, "--live-origin", typed), "allowed: the origin of a web page")
            for typed in ("foo", "ftp://a.b", "https://a.b/view", "https://")
        ),
    ],
)
def test_invalid_output_or_input_paths_are_rejected_before_work_starts(
    words: tuple[str, ...], problem: str
) -> None:
    assert problem in refused(2, *words)


def test_an_error_is_also_printed_as_json() -> None:
    result = cdpr_here("drive", "info", "no-such-winch", *OWN, "--json")
    told = json.loads(result.stdout.splitlines()[-1])
    assert told["ok"] is False
    assert told["exit_status"] == result.returncode == 2
    assert told["error"] in result.stderr


def test_ctrl_c_while_a_command_loads_prints_no_traceback() -> None:
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


def test_ctrl_c_during_shutdown_of_the_interpreter_prints_no_traceback() -> None:
    code = (
        "import atexit, os, signal, sys; from cdpr_tools import cli;"
        "atexit.register(os.kill, os.getpid(), signal.SIGINT);"
        "sys.argv = ['cdpr', '--version']; cli.main()"
    )
    told = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, timeout=60, check=False
    )
    assert (told.returncode, told.stderr) == (0, "")


def test_the_version_is_that_of_the_package() -> None:
    told = cdpr_here("--version")
    assert (told.returncode, told.stdout) == (0, f"cdpr {version('cdpr-rt')}\n")


def test_a_shell_completes_commands_and_subcommands() -> None:
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
def test_a_missing_optional_package_is_named(module: str, words: list[str]) -> None:
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


@pytest.mark.parametrize("words", [("--robot",), ("--robot", "--json"), ("--robot=",)])
def test_a_robot_option_without_a_robot_is_rejected(
    words: tuple[str, ...], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("CDPR_ROBOT", "planar-3")
    assert "--robot: give the name or the file of a robot" in refused(2, "robot", "show", *words)


def test_a_fault_is_injected_on_buses_of_simulated_drives_only() -> None:
    bus = ("--bus", "socketcan:can0")
    message = refused(2, "sim", "fault", WINCH, "cut-cable", *bus)
    assert "socketcan:can0: allowed: a simulated bus" in message


def test_an_axis_in_place_of_the_size_of_a_fault_is_rejected_with_its_option() -> None:
    message = refused(2, "sim", "fault", "planar-3", "cut-cable", "upper left", "--bus", "simbus:x")
    assert "cut-cable upper left: choose the axis with: --axis 'upper left'" in message
