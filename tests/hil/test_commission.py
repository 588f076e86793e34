"""Complete commissionings by command on the embedded bus."""

from __future__ import annotations

import json
import re
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import pytest
from cdpr_here import cdpr_here

from cdpr_rt.identification.commissioning_results import Paths
from tests.slower_robot import slower_robot, slower_winch
from tests.test_examples import run_example

PLANTS = Path(__file__).parent / "plants"


def cdpr(*arguments: str | Path, timeout_s: float = 300.0) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-m", "cdpr_tools.cli", *map(str, arguments)]
    return subprocess.run(command, capture_output=True, text=True, timeout=timeout_s, check=False)


def last_line(result: subprocess.CompletedProcess[str]) -> dict[str, Any]:
    assert result.returncode == 0, result.stderr[-2000:]
    return dict(json.loads(result.stdout.splitlines()[-1]))


def commission(
    out: Path, *more: str | Path, winch: str | Path = "winch-mpp0923d"
) -> dict[str, Any]:
    base: Sequence[str | Path] = ("commission", winch, "--bus", "simbus:", "--json")
    return last_line(cdpr(*base, "--out", out, *more))


@pytest.fixture(scope="module")
def slower(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return slower_winch(tmp_path_factory.mktemp("winch"), "winch-mpp0923d", 0.004)


@pytest.fixture(scope="module")
def default(
    slower_profiles: None, tmp_path_factory: pytest.TempPathFactory
) -> tuple[Path, dict[str, Any]]:
    """Commission by the example with a tenth of the measurements. `make demo` takes them all."""
    folder = tmp_path_factory.mktemp("default")
    printed = ["cogging of order 4: ", "compensation harmonic: 0.", "report: "]
    run_example("commission_motor.py", folder, printed)
    paths = Paths(folder / "commission_motor")
    return paths.out, json.loads(paths.results.read_text())


def test_commissioning_the_default_plant_reaches_the_documented_figures(
    default: tuple[Path, dict[str, Any]],
) -> None:
    _, result = default
    validation = result["validation"]
    assert validation["judged_on"] == "true angle"
    harmonic, thesis = validation["harmonic"]["ratios"], validation["thesis"]["ratios"]
    assert harmonic["rms_position_error"] >= 10
    assert harmonic["peak_pid_effort"] >= 10
    assert harmonic["peak_velocity_error"] >= 8
    assert thesis["rms_position_error"] >= 3
    assert thesis["peak_pid_effort"] >= 6
    assert result["bus"]["overruns"] == 0
    assert result["bus"]["missed"] == 0
    # the true amplitude of the plant file, 60 mNm, in drive units
    assert result["identification"]["orders"] == [4]
    assert result["identification"]["amplitudes_Nm"][0] == pytest.approx(0.06 / 1.04, rel=0.03)


def test_the_report_can_be_made_again_offline(default: tuple[Path, dict[str, Any]]) -> None:
    out, result = default
    (out / "report.html").unlink()
    again = last_line(cdpr_here("cogging", "report", out, "--json"))
    assert (out / "report.html").stat().st_size > 50_000
    assert again["validation"] == result["validation"]


def test_the_fit_can_be_repeated_from_raw_data(default: tuple[Path, dict[str, Any]]) -> None:
    out, result = default
    again = last_line(cdpr_here("cogging", "fit", out, "--json"))
    assert again["identification"]["orders"] == result["identification"]["orders"]
    assert again["identification"]["amplitudes_Nm"] == pytest.approx(
        result["identification"]["amplitudes_Nm"], rel=1e-6
    )


def test_a_profile_works_later_at_a_different_cycle_rate(
    default: tuple[Path, dict[str, Any]], slower: Path, tmp_path: Path
) -> None:
    out, _ = default
    profile = out / "cogging-profile.json"
    arguments = ("cogging", "validate", slower, profile, "--bus", "simbus:", "--json")
    result = last_line(cdpr(*arguments, "--out", tmp_path / "later"))
    validation = result["validation"]
    assert validation["harmonic"]["ratios"]["rms_position_error"] >= 10


def test_a_truncated_raw_file_is_reported(
    default: tuple[Path, dict[str, Any]], tmp_path: Path
) -> None:
    out, _ = default
    raw = tmp_path / "raw"
    raw.mkdir()
    whole = (out / "raw" / "sweep-0.raw").read_bytes()
    (raw / "sweep-0.raw").write_bytes(whole[: len(whole) // 50])
    result = cdpr_here("cogging", "fit", tmp_path)
    assert result.returncode == 1
    assert "sweep-0.raw" in result.stderr
    assert "Traceback" not in result.stderr


def test_a_motor_unstable_with_the_default_gain_is_commissioned(
    slower: Path, tmp_path: Path
) -> None:
    plant = PLANTS / "runaway.toml"
    result = commission(tmp_path, "--plant", plant, "--quick", winch=slower)
    ratios = result["validation"]["harmonic"]["ratios"]
    assert ratios["rms_position_error"] > 3
    assert ratios["peak_pid_effort"] > 3


MORE_UNKNOWN = {
    "[friction]": "[friction]\nangle_share = 0.06",
    "[encoder]": "[encoder]\neccentricity_rad = 3e-4\ninterpolation_error = 0.04",
    "seed = 11": "seed = 11\n[ripple]\nsixth = 0.01\ntwelfth = 0.005\n"
    "[drive]\nfeedback_jitter_s = 4e-5",
}
"""Twice the usual effects that the identification does not model."""


def test_an_odd_motor_of_a_robot_is_compensated(tmp_path: Path) -> None:
    plant = tmp_path / "robot.toml"
    odd = (PLANTS / "slots-offset-asymmetric-odd-encoder.toml").read_text()
    for key, text in MORE_UNKNOWN.items():
        odd = odd.replace(key, text)
    seed, tables = odd.split("\n", 1)
    plant.write_text(seed + "\n" + re.sub(r"(?m)^(\[+)", r"\1motor.", tables))
    base = (
        "commission",
        slower_robot(tmp_path, "planar-3"),
        "--axis",
        "upper right",
        "--bus",
        "simbus:",
        "--quick",
    )
    told = last_line(cdpr(*base, "--plant", plant, "--out", tmp_path, "--json"))
    assert list(told["axes"]) == ["upper right"]
    assert (Path(told["commissioned"]) / "upper-right" / "cogging-profile.json").is_file()
    result = told["axes"]["upper right"]
    assert set(result["identification"]["orders"]) >= {4, 24}
    ratios = result["validation"]["harmonic"]["ratios"]
    assert ratios["rms_position_error"] > 3
    assert ratios["peak_pid_effort"] > 3
