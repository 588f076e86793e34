"""Recordings of motors as CSV become passes from which the cogging is identified."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from cdpr_here import cdpr_here

from cdpr_profiles import load_winch
from cdpr_rt.identification.rawlog import read_raw_log
from tests.cdpr_rt.identification.bench import Bench, TruePlant
from tests.tools.imports.made_up_recording import HUNTING, WINCH, mapping, turn

SMOOTH = TruePlant(
    terms=((4, 0.03, 17.0), (24, 0.02, 40.0)), coulomb=0.03, breakaway=0.035, kt_error=0.0
)


def done(*arguments: str | Path) -> dict[str, Any]:
    result = cdpr_here(*arguments, "--json")
    assert result.returncode == 0, result.stderr
    return dict(json.loads(result.stdout.splitlines()[-1]))


def imported(out: Path, map_file: Path, *files: Path) -> dict[str, Any]:
    return done("import", "motor", WINCH, *files, "--map", map_file, "--out", out, "--overwrite")


@pytest.fixture(scope="module")
def recorded(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    folder = tmp_path_factory.mktemp("csv")
    bench = Bench(SMOOTH)
    speeds = {"fast": 40.0, "back": -40.0, "slow": 25.0}
    return {name: turn(bench, folder / f"{name}.csv", v, kp=1.0) for name, v in speeds.items()}


def test_the_cogging_is_identified_from_a_csv_of_one_direction(
    recorded: dict[str, Path], tmp_path: Path
) -> None:
    imported(tmp_path, mapping(tmp_path), recorded["fast"])
    found = done("cogging", "fit", tmp_path)["identification"]
    assert found["directions"] == [1]
    amplitude = dict(zip(found["orders"], found["amplitudes_Nm"], strict=True))
    assert amplitude[4] == pytest.approx(0.03, rel=0.05)
    assert amplitude[24] == pytest.approx(0.02, rel=0.1)
    stored = json.loads((tmp_path / "cogging-profile.json").read_text())
    assert stored["harmonic"]["look_ahead_s"] == load_winch(WINCH).latency_s
    text = cdpr_here("cogging", "fit", tmp_path).stdout
    assert "measured at increasing angle only and assumed for both" in text


def test_the_filter_of_the_torque_reading_is_found(
    recorded: dict[str, Path], tmp_path: Path
) -> None:
    both = (recorded["fast"], recorded["back"], recorded["slow"])
    result = imported(tmp_path, mapping(tmp_path, lag='"fit"'), *both)
    assert result["torque_lag_s"] == pytest.approx(0.1, rel=0.15)


def test_a_filter_is_reported_unless_its_time_constant_is_given(
    recorded: dict[str, Path], tmp_path: Path
) -> None:
    notes = imported(tmp_path, mapping(tmp_path, lag=""), recorded["fast"], recorded["back"])
    assert "seems to be low-passed" in " ".join(notes["notes"])
    notes = imported(tmp_path, mapping(tmp_path, lag="0.1"), recorded["fast"], recorded["back"])
    assert notes["notes"] == []


def test_the_filter_of_a_motor_that_sticks_and_slips_is_not_fitted(tmp_path: Path) -> None:
    file = turn(Bench(HUNTING), tmp_path / "a.csv", 36.0)
    result = cdpr_here(
        *("import", "motor", WINCH, file, "--map", mapping(tmp_path, lag='"fit"')),
        *("--out", tmp_path / "out"),
    )
    assert result.returncode == 2
    assert "torque_lag_s: cannot be fitted" in result.stderr


def test_signs_turn_the_motor_around(recorded: dict[str, Path], tmp_path: Path) -> None:
    imported(tmp_path, mapping(tmp_path, sign=-1), recorded["fast"])
    log = read_raw_log(tmp_path / "raw" / "sweep-0.raw")
    assert log.header["speed_rad_s"] < 0.0
    assert log.column("torque_sent_Nm").mean() < 0.0
    assert done("cogging", "fit", tmp_path)["identification"]["directions"] == [-1]


def test_negative_friction_is_rejected_with_the_cause(
    recorded: dict[str, Path], tmp_path: Path
) -> None:
    wrong = mapping(tmp_path, torque='torque = { name = "iq", unit = "A_peak", sign = -1 }')
    imported(tmp_path, wrong, recorded["fast"])
    result = cdpr_here("cogging", "fit", tmp_path)
    assert result.returncode == 1
    assert "friction at increasing angle is negative" in result.stderr


def test_there_and_back_in_one_file_become_two_passes(
    recorded: dict[str, Path], tmp_path: Path
) -> None:
    there, back = (recorded[name].read_text().splitlines()[2:] for name in ("fast", "back"))
    end = float(there[-1].split(";")[0])
    later = [
        f"{float(line.split(';')[0]) + end + 5.0:.3f};{line.split(';', 1)[1]}" for line in back
    ]
    file = tmp_path / "both.csv"
    file.write_text("\n".join(["t;phi;iq", *there, *later]) + "\n")
    passes = imported(tmp_path / "out", mapping(tmp_path), file)["passes"]
    assert [one["speed_deg_s"] > 0.0 for one in passes] == [True, False]


def test_long_gaps_are_not_interpolated(tmp_path: Path) -> None:
    file = turn(Bench(SMOOTH), tmp_path / "a.csv", 36.0, gaps_s=(3.0, 6.0))
    facts = imported(tmp_path / "out", mapping(tmp_path), file)["passes"][0]
    assert facts["in_gaps"] == pytest.approx(0.2 / 10.0, rel=0.2)
    found = done("cogging", "fit", tmp_path / "out")["identification"]
    assert {4, 24} <= set(found["orders"])


def test_other_recordings_are_compared_for_each_method(
    recorded: dict[str, Path], tmp_path: Path
) -> None:
    for name in ("fast", "slow"):
        imported(tmp_path / name, mapping(tmp_path), recorded[name])
    done("cogging", "fit", tmp_path / "fast")
    own, other = done("cogging", "compare", tmp_path / "fast", tmp_path / "slow")["runs"]
    assert own["identified_from"] and not other["identified_from"]
    assert other["r2"]["harmonic"] > 0.9
    assert other["r2"]["harmonic"] >= other["r2"]["least squares"]
    assert other["r2"]["harmonic"] >= other["r2"]["thesis"] - 0.002
    assert "shifted" not in other


@pytest.mark.parametrize(
    ("spoil", "changes", "text"),
    [
        (None, {"angle": 'angle = { name = "x" }'}, "no column 'x'; its columns: t, phi, iq"),
        (
            None,
            {"angle": 'angle = { name = "phi", unit = "m" }'},
            "unit 'm'; allowed as `unit`: rad, deg",
        ),
        (("1.0;2.0;3.0", "1.0;2,5;3.0"), {}, "line 4: phi: value '2,5': earlier numbers have '.'"),
        (("\n1", "\n0"), {}, "line 4: t: the time does not increase: 0.000000 s, then 0.000000"),
        (("1.0;2.0;3.0", "1.0;2.0;3.0;4.0"), {}, "line 4: 4 cells; allowed: up to 3"),
        (None, {}, "no motion of at least half a turn in one direction"),
        (None, {"time": 'time = { name = "t" }'}, "apart; allowed: up to 0.05 s; check the unit"),
        (None, {"time": 'time = { name = "t", unit = "ns" }'}, "check the units of time and angle"),
        (("1.0;2.0;3.0", "1.0;2.0;0.1"), {}, "column 'iq': 0.0396687 Nm in all rows"),
    ],
)
def test_a_wrong_file_or_mapping_is_named_with_the_place(
    tmp_path: Path, spoil: tuple[str, str] | None, changes: dict[str, str], text: str
) -> None:
    lines = ["# drive log", "t;phi;iq", "0.0;1.0;0.1", "1.0;2.0;3.0"]
    lines += [f"{k};{2.0 + 0.1 * k};0.1" for k in range(2, 300)]
    content = "\n".join(lines)
    (tmp_path / "a.csv").write_text(content.replace(*spoil) if spoil else content)
    map_file = mapping(tmp_path, **changes)
    result = cdpr_here(
        *("import", "motor", WINCH, tmp_path / "a.csv", "--map", map_file),
        *("--out", tmp_path / "out"),
    )
    assert result.returncode == 2
    assert text in result.stderr


def test_rows_with_an_empty_cell_or_out_of_order_are_left_out_with_a_note(
    recorded: dict[str, Path], tmp_path: Path
) -> None:
    *names, first = recorded["fast"].read_text().splitlines()[:3]
    rows = [first, *recorded["fast"].read_text().splitlines()[3:]]
    for row in (300, 700):
        rows[row] = rows[row].rsplit(";", 1)[0] + ";"
    rows[500], rows[501] = rows[501], rows[500]
    (tmp_path / "a.csv").write_text("\n".join([*names, *rows, rows[-1][:4]]))
    result = cdpr_here(
        *("import", "motor", WINCH, tmp_path / "a.csv", "--map", mapping(tmp_path)),
        *("--out", tmp_path / "out"),
    )
    assert result.returncode == 0, result.stderr
    count = len(rows) + 1
    told = result.stdout + result.stderr
    assert f"left out 3 of {count} rows with an empty cell, the first in line 303" in told
    assert f"left out 1 of {count - 3} rows whose time does not increase" in told


@pytest.mark.parametrize("late_s", [0.0, 0.005])
def test_an_angle_that_begins_again_after_each_turn_is_unwrapped(
    tmp_path: Path, late_s: float
) -> None:
    angle = f'angle = {{ name = "phi", unit = "deg", time_offset_s = {late_s} }}'
    time = np.arange(0.0, 20.0, 0.01)
    rows = [f"{1e3 * t},{(50.0 * t) % 360.0},{0.1 + 0.01 * np.sin(t)}" for t in time]
    (tmp_path / "a.csv").write_text("\n".join(["t,phi,iq", *rows]))
    at = mapping(tmp_path, angle=angle)
    (only,) = imported(tmp_path / "out", at, tmp_path / "a.csv")["passes"]
    assert only["turns"] == pytest.approx(20.0 * 50.0 / 360.0, abs=0.01)


def test_a_static_map_is_compared(recorded: dict[str, Path], tmp_path: Path) -> None:
    imported(tmp_path / "run", mapping(tmp_path), recorded["fast"])
    done("cogging", "fit", tmp_path / "run")
    angle = np.arange(0.0, 360.0, 1.0)
    torque = SMOOTH.wave(SMOOTH.terms, np.radians(angle + 0.5)) + 0.03  # shifted by hysteresis
    rows = [f"{a},{t:.6f}" for a, t in zip(angle, torque, strict=True)]
    (tmp_path / "map.csv").write_text("\n".join(["deg,Nm", *rows]) + "\n")
    (tmp_path / "static.toml").write_text(
        '[columns]\nangle = { name = "deg", unit = "deg" }\ntorque = { name = "Nm" }\n'
    )
    imported(tmp_path / "map", tmp_path / "static.toml", tmp_path / "map.csv")
    *_, told = done("cogging", "compare", tmp_path / "run", tmp_path / "map")["runs"]
    assert told["r2"]["harmonic"] > 0.95
    assert told["shifted"]["harmonic"]["r2"] > told["r2"]["harmonic"] + 0.005
    assert told["shifted"]["harmonic"]["shift_deg"] == pytest.approx(-0.5, abs=0.15)
