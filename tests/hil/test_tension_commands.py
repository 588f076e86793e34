"""Commands for winch calibration and load cells agree with the simulator's truth."""

from __future__ import annotations

import io
import json
import os
import re
import signal
import subprocess
import sys
import time
import uuid
from collections.abc import Iterator
from contextlib import contextmanager, redirect_stderr, redirect_stdout
from pathlib import Path
from typing import Any

import pytest
from waiting import until

from cdpr_profiles import load_winch
from cdpr_profiles.places import SHIPPED
from cdpr_profiles.winch_calibration import WinchCalibration
from cdpr_sim_bus.physics_board import PhysicsBoard
from cdpr_tools.cli import main

WINCH = "winch-mpp0923d"
ANCHOR = "[load]\nkind = 'fixed_anchor'\npretension_N = 2.0\nanchor_stiffness_N_m = 500.0\n"
FAILED, BAD_INPUT = 1, 2


def cdpr(*arguments: str | Path) -> list[str]:
    return [sys.executable, "-m", "cdpr_tools.cli", *map(str, arguments)]


def invoke(*arguments: str | Path, status: int = 0) -> str:
    """Run a command in this process, which has the libraries loaded. Return its output."""
    out, notes = io.StringIO(), io.StringIO()
    with (
        pytest.MonkeyPatch.context() as patch,
        redirect_stdout(out),
        redirect_stderr(notes),
        pytest.raises(SystemExit) as ended,
    ):
        patch.setattr(sys, "argv", ["cdpr", *map(str, arguments)])
        patch.setattr(sys, "stdin", io.StringIO())
        main()
    assert (ended.value.code or 0) == status, notes.getvalue()
    return out.getvalue()


def run(*arguments: str | Path, status: int = 0) -> dict[str, Any]:
    result: dict[str, Any] = json.loads(
        invoke(*arguments, "--json", status=status).splitlines()[-1]
    )
    return result


class Simulator:
    """A running simulator and its line of readiness."""

    def __init__(self, process: subprocess.Popen[str], ready: dict[str, Any]) -> None:
        self.process = process
        self.port = str(ready.get("port"))

    def tell(self, text: str) -> None:
        assert self.process.stdin is not None
        self.process.stdin.write(text + "\n")
        self.process.stdin.flush()


@contextmanager
def simulator(*arguments: str | Path) -> Iterator[Simulator]:
    """Run `cdpr sim ...` in the background."""
    process = subprocess.Popen(
        cdpr("sim", *arguments, "--exit-with-stdin"),
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
    )
    try:
        assert process.stdout is not None
        yield Simulator(process, json.loads(process.stdout.readline())["ready"])
    finally:
        process.communicate(timeout=120)


@contextmanager
def winch(folder: Path, plant: str) -> Iterator[tuple[str, Path]]:
    """Run a simulated winch. Yield its bus and its board."""
    (folder / "plant.toml").write_text(plant)
    bus, board = f"simbus:ten-{os.getpid()}-{uuid.uuid4().hex[:6]}", folder / "board"
    with simulator("up", WINCH, "--bus", bus, "--plant", folder / "plant.toml", "--board", board):
        yield bus, board


def without_power(board: PhysicsBoard) -> None:
    """Wait until the winch has no power. Bus time stands for half a second after the last SYNC."""
    until(lambda: not board.axis(0).state().power_on)


def gain(result: dict[str, Any], true: float) -> None:
    """Check that the gain is right within 1 % and within three times its interval."""
    assert result["gain_m"] == pytest.approx(true, rel=0.01)
    assert abs(result["gain_m"] - true) < 3.0 * result["gain_half_width_m"] + 1e-3 * true


def test_calibration_with_masses_finds_gain_and_friction(tmp_path: Path) -> None:
    (tmp_path / "plant.toml").write_text(
        "seed = 3\n[motor]\ntorque_constant_error = -0.06\n[[cogging]]\norder = 24\n"
        "amplitude_Nm = 0.04\n[[cogging]]\norder = 4\namplitude_Nm = 0.1\n"
        "kind = 'current_offset'\n[friction]\ndirection_asymmetry = 0.5\n"
        "[load]\nkind = 'hung_mass'\ndrum_radius_error = 0.08\nfriction_share = 0.12\n"
        "winch_friction_Nm = 0.05\ncable_m = 2.0\nslack_m = 0.02\n"
    )
    out = tmp_path / "out"
    result = run(
        *("tension", "calibrate", WINCH, "--bus", "simbus:", "--masses", "2,4,7"),
        *("--turns", "1", "--speed-mm-s", "90", "--lead-mm", "80"),
        *("--plant", tmp_path / "plant.toml", "--out", out),
    )
    true = 0.026 * 1.08 / 0.94
    gain(result, true)
    assert result["friction_per_N_m"] == pytest.approx(0.12 * true, rel=0.1)
    stored = WinchCalibration.load_file(Path(result["calibration"]))
    assert stored.gain_m == result["gain_m"]
    assert all((out / name).is_file() for name in stored.raw_data)


def tare(folder: Path, port: str) -> None:
    """Tare in the file for an amplifier that cannot, then by the amplifier."""
    shipped = (SHIPPED / "tension_sensors" / "rtu-load-cell-1.toml").read_text()
    start, end = shipped.index("[amplifier.tare]"), shipped.index("[[sensors]]")
    plain = folder / "plain.toml"
    plain.write_text(shipped[:start] + shipped[end:])
    seconds = ("--seconds", "0.3")
    (cable,) = run("tension", "tare", "--sensors", plain, "--tension-port", port, *seconds)[
        "cables"
    ]
    assert cable["zero_N"] == cable["before_N"] == pytest.approx(2.0, abs=1.5)
    plain.write_text(plain.read_text() + f"zero_N = {cable['zero_N']}\n")
    (cable,) = run("tension", "tare", "--sensors", plain, "--tension-port", port, *seconds)[
        "cables"
    ]
    assert cable["before_N"] == pytest.approx(0.0, abs=0.1)
    sensors = ("--sensors", "rtu-load-cell-1")
    (cable,) = run("tension", "tare", *sensors, "--tension-port", port, *seconds)["cables"]
    assert cable["after_N"] == pytest.approx(0.0, abs=0.1)


def watched_session(folder: Path, bus: str, cells: Simulator) -> None:
    """Check that load cells prevent motion of `cdpr drive`."""
    tight = folder / "tight.toml"
    text = (SHIPPED / "tension_sensors" / "rtu-load-cell-1.toml").read_text()
    tight.write_text("stop_above_N = 50.0\n" + text + "zero_N = -100.0\n")
    watched = (WINCH, "--bus", bus, "--seconds", "0.2", "--tension-port", cells.port, "--sensors")
    assert run("drive", "jog", *watched, "rtu-load-cell-1")["ok"]
    error = run("drive", "enable", *watched, tight, status=FAILED)["error"]
    assert re.fullmatch(r"axis 1: load cell winch 1: \d+\.\d N, 50 N allowed", error)
    cells.tell("broken-wire 1")
    home = ("drive", "home", WINCH, "--bus", bus, "--sensors", "rtu-load-cell-1")
    error = run(*home, "--tension-port", cells.port, status=FAILED)["error"]
    assert error == "axis 1: winch 1: tension sensor: broken wire"
    cells.tell("mend 1")
    assert "give both, the load cells" in run(*home, status=BAD_INPUT)["error"]


@pytest.mark.alone  # a simulated line answers within 50 ms of wall-clock time
def test_calibration_with_a_load_cell_finds_gain_and_friction(tmp_path: Path) -> None:
    plant = ANCHOR + "drum_radius_error = 0.03\n"
    out = tmp_path / "out"
    sensors = "rtu-load-cell-1"
    with (
        winch(tmp_path, plant) as (bus, board),
        simulator("tension", sensors, "--board", board) as cells,
    ):
        seen = run("tension", "watch", "--sensors", sensors, "--tension-port", cells.port,
                   "--seconds", "0.5")  # fmt: skip
        (cable,) = seen["cables"]
        assert cable["valid"] and cable["mean_N"] == pytest.approx(2.0, abs=1.5)
        assert cable["rate_Hz"] > 8.0
        tare(tmp_path, cells.port)
        watched_session(tmp_path, bus, cells)
        result = run(
            *("tension", "calibrate", WINCH, "--bus", bus, "--sensors", sensors),
            *("--tension-port", cells.port, "--out", out),
            *("--speed-mm-s", "100", "--highest-n", "60"),
        )
        with PhysicsBoard.attach(board) as shared:
            without_power(shared)
            broken = subprocess.Popen(
                cdpr("tension", "calibrate", WINCH, "--bus", bus, "--sensors", sensors,
                     "--tension-port", cells.port, "--out", tmp_path / "broken",
                     "--speed-mm-s", "100", "--json"),
                stdout=subprocess.PIPE, text=True,
            )  # fmt: skip
            while shared.axis(0).state().tension_N < 20.0:
                assert broken.poll() is None
                time.sleep(0.005)
            cells.tell("silent 1")
            told, _ = broken.communicate(timeout=120)
            assert broken.returncode == FAILED
            error = json.loads(told.splitlines()[-1])["error"]
            assert "winch 1: tension sensor: stale" in error
            assert str(tmp_path / "broken" / "raw") in error
            without_power(shared)
    gain(result, 0.026 * 1.03 / 1.04 / 1.001)
    assert result["friction_per_N_m"] == pytest.approx(0.05 * 0.02575, rel=0.25)
    again = run("tension", "fit", out)
    assert again["gain_m"] == result["gain_m"]
    assert Path(again["picture"]).read_bytes().startswith(b"\x89PNG")


def test_invalid_calibration_options_are_rejected(tmp_path: Path) -> None:
    calibrate = ("tension", "calibrate", WINCH, "--bus", "simbus:nobody", "--out", tmp_path / "o")
    for more, message in (
        (("--masses", "2,5"), "at least three different masses"),
        (("--masses", "2,5,50"), "up to 10.6 kg"),
        (
            ("--sensors", "rtu-load-cell-1", "--tension-port", "x", "--highest-n", "200"),
            "at most 104 N",
        ),
        (("--masses", "nan,2,5"), "at least three different masses"),
        (("--masses", "2,5,5.0,9"), "at least three different masses"),
        (("--masses", "5,6,7"), "the heaviest must be at least 2 times the lightest"),
        (("--masses", "2;5;9"), "allowed: numbers in kg"),
        (
            ("--masses", "2,5,9", "--tension-port", "x"),
            "--tension-port and --cable go with --sensors",
        ),
        (("--sensors", "rtu-load-cell-1"), "--sensors needs --tension-port"),
        (
            ("--sensors", "rtu-load-cell-1", "--tension-port", "x", "--board", "b"),
            "--board goes with",
        ),
        ((), "give either --masses or --sensors"),
    ):
        result = run(*calibrate, *more, status=BAD_INPUT)
        assert message in result["error"]


def test_a_calibration_with_too_much_slack_fails_and_keeps_its_data(tmp_path: Path) -> None:
    out = tmp_path / "out"
    (tmp_path / "plant.toml").write_text("[load]\nkind = 'hung_mass'\nslack_m = 0.3\n")
    result = run(
        *("tension", "calibrate", WINCH, "--bus", "simbus:", "--masses", "2,5,9"),
        *("--speed-mm-s", "100"),
        *("--plant", tmp_path / "plant.toml", "--out", out),
        status=FAILED,
    )
    assert "the mass did not always hang freely" in result["error"]
    assert "--lead-mm" in result["error"] and str(out / "raw") in result["error"]
    assert [path.name for path in (out / "raw").iterdir()] == ["mass-2kg.raw"]
    assert not (out / "winch-calibration.toml").exists()
    result = run(
        *("tension", "calibrate", WINCH, "--bus", "simbus:", "--masses", "2,5,9", "--out", out),
        status=BAD_INPUT,
    )
    assert "--overwrite" in result["error"]
    foreign = out / "raw" / "sweep.raw"
    foreign.write_text("of a commissioning")
    real = ("--bus", "socketcan:none", "--masses", "2,5,9", "--out", out, "--overwrite")
    result = run("tension", "calibrate", WINCH, *real, status=BAD_INPUT)
    assert "not confirmed" in result["error"]
    assert (out / "raw" / "mass-2kg.raw").exists()  # deletion was not confirmed
    result = run("tension", "calibrate", WINCH, *real, "--yes", status=BAD_INPUT)
    assert "socketcan:none" in result["error"]
    assert [path.name for path in (out / "raw").iterdir()] == ["sweep.raw"]
    (tmp_path / "raw").write_text("a file")
    result = run(
        *("tension", "calibrate", WINCH, "--bus", "simbus:x", "--masses", "2,5,9"),
        *("--out", tmp_path),
        status=BAD_INPUT,
    )
    assert "cannot be written" in result["error"]


def test_stopping_lowers_the_mass_and_a_dead_load_cell_stops_the_pull(tmp_path: Path) -> None:
    plant = "[load]\nkind = 'hung_mass'\n[encoder]\nnoise_counts = 0.0\n"
    with winch(tmp_path, plant) as (bus, board), PhysicsBoard.attach(board) as shared:
        axis = shared.axis(0)
        process = subprocess.Popen(
            cdpr("tension", "calibrate", WINCH, "--bus", bus, "--masses", "4,6,8", "--board",
                 board, "--out", tmp_path / "stopped", "--turns", "20",
                     "--speed-mm-s", "80", "--json"),
            stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
        )  # fmt: skip
        while axis.state().tension_N < 35.0 or axis.state().motor_rad > -9.0:
            assert process.poll() is None
            time.sleep(0.001)
        process.send_signal(signal.SIGINT)
        out, _ = process.communicate(timeout=120)
        assert process.returncode == FAILED
        assert "stopped on request" in json.loads(out.splitlines()[-1])["error"]
        without_power(shared)
        state = axis.state()
        assert abs(state.motor_rad) < 3.0  # back at the start, with the mass on the floor
        sign_wrong = tmp_path / "wrong.toml"
        told = load_winch(WINCH).path.read_text()
        sign_wrong.write_text(told.replace("cable_sign = 1", "cable_sign = -1"))
        result = run(
            *("tension", "calibrate", sign_wrong, "--bus", bus, "--masses", "4,6,8"),
            *("--board", board, "--out", tmp_path / "wrong", "--speed-mm-s", "120"),
            *("--turns", "1", "--lead-mm", "80"),
            status=FAILED,
        )
        assert re.match(
            r"4 kg should hang there, but the torque corresponds to -?0\.", result["error"]
        )
        assert "cable_sign" in result["error"]
        without_power(shared)
        invoke("sim", "hang", "7.5", "--board", board)
        assert axis.hung_mass_kg == 7.5

        options = ("--board", board, "--fault", "silent 1")
        with simulator("tension", "rtu-load-cell-1", *options) as cells:
            port = ("--tension-port", cells.port)
            result = run("tension", "calibrate", WINCH, "--bus", bus, "--sensors",
                         "rtu-load-cell-1", *port, "--out", tmp_path / "dead",
                         status=FAILED)  # fmt: skip
            assert "winch 1: " in result["error"] and "no answer within" in result["error"]
