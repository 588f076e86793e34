"""Recordings of other programs become recordings that `cdpr log` reads."""

from __future__ import annotations

import json
import struct
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow.csv
import pytest
from cdpr_here import cdpr_here

from cdpr_profiles import load_robot
from tests.tools.imports.test_calibration_import import MAP, cable_lengths_m, recorded

ROBOT = load_robot("planar-3")


def done(*arguments: str | Path) -> dict[str, Any]:
    """Run a command and return its result."""
    ended = cdpr_here(*arguments, "--json")
    assert ended.returncode == 0, ended.stderr
    return dict(json.loads(ended.stdout.splitlines()[-1]))


def exported(recording: Path) -> pyarrow.Table:
    """Return the rows of a recording, as `cdpr log export` writes them."""
    table = recording.with_suffix(".csv")
    done("log", "export", recording, "--out", table)
    return pyarrow.csv.read_csv(table)


def test_lengths_and_motion_capture_become_one_recording(tmp_path: Path) -> None:
    lengths, take, mapping = recorded(tmp_path)
    out = tmp_path / "imported.mcap"
    files = (lengths, "--poses", take, "--map", mapping)
    told = done("import", "log", "planar-3", *files, "--out", out)
    assert told["rows"] == 400 and told["fields"] == ["cable_length_m", "tension_N", "pose"]
    rows = exported(out)
    place = np.column_stack([rows["pose[x]"].to_numpy(), rows["pose[y]"].to_numpy()])
    hidden = np.isnan(place[:, 0])
    assert 0.1 < hidden.mean() < 0.15
    expected = cable_lengths_m(place[~hidden])
    for k, axis in enumerate(ROBOT.axes):
        told_m = rows[f"cable_length_m[{axis.name}]"].to_numpy()[~hidden]
        assert np.abs(told_m - expected[:, k]).max() < 1e-4
        assert rows[f"position_rad[{axis.name}]"].null_count == 400
    assert done("log", "plot", out)["rows"] == 400
    (info,) = done("log", "info", out)["recordings"]
    assert info["axes"] == [axis.name for axis in ROBOT.axes] and info["ended"] == "closed"
    again = cdpr_here("import", "log", "planar-3", *files, "--out", out)
    assert again.returncode == 2 and "--overwrite" in again.stderr


def test_poses_alone_become_a_recording(tmp_path: Path) -> None:
    _, take, mapping = recorded(tmp_path)
    mapping.write_text(MAP[MAP.index("[pose]") :])
    out = tmp_path / "imported.mcap"
    told = done("import", "log", "planar-3", take, "--map", mapping, "--out", out)
    assert told["fields"] == ["pose"] and told["seconds"] == pytest.approx(479 / 120)
    assert done("log", "plot", out)["rows"] == told["rows"]


def test_a_bus_log_of_several_drives_becomes_a_recording(tmp_path: Path) -> None:
    begin_s, lines = 1_700_000_000, []
    for k in range(500):
        lines.append(f"({begin_s}.{1000 * k:06d}) can0 080#")
        for i, axis in enumerate(ROBOT.axes):
            data = struct.pack("<Hih", 0x0237, 8 * k * (i + 1), 100 * i).hex()
            at = f"({begin_s}.{1000 * k + 100 + i:06d})"
            lines.append(f"{at} can0 {0x180 + axis.node_id:03X}#{data}")
    ends = begin_s + 1
    lines += [f"({ends}.000000) can0 080#", f"({ends}.000100) {lines[-1].split(maxsplit=1)[1]}"]
    (tmp_path / "bus.log").write_text("\n".join(lines) + "\n")

    def of_axes(number: str) -> str:
        return ", ".join(f'{{ name = "{axis.name}.{number}" }}' for axis in ROBOT.axes)

    (tmp_path / "map.toml").write_text(
        f'[cables]\ntime = {{ name = "time_s" }}\nangles = [{of_axes("6064")}]\n'
        f"torques = [{of_axes('6077')}]\n"
    )
    out = tmp_path / "imported.mcap"
    files = (tmp_path / "bus.log", "--map", tmp_path / "map.toml")
    told = done("import", "log", "planar-3", *files, "--out", out)
    assert told["rows"] == 500  # without the last cycle, which is incomplete
    rows = exported(out)
    for i, axis in enumerate(ROBOT.axes):
        turn = 2.0 * np.pi * 8 * (i + 1) / axis.winch.encoder_counts_per_turn
        angle = rows[f"position_rad[{axis.name}]"].to_numpy()
        assert np.abs(angle - turn * np.arange(500)).max() < 1e-6
        torque = 1e-3 * 100 * i * axis.winch.motor.rated_torque_Nm
        assert rows[f"torque_actual_Nm[{axis.name}]"].to_numpy() == pytest.approx(torque)


def test_a_kind_of_column_that_misses_an_axis_is_named(tmp_path: Path) -> None:
    lengths, take, mapping = recorded(tmp_path)
    mapping.write_text(MAP.replace(', { name = "f3" }', ""))
    files = (lengths, "--poses", take, "--map", mapping, "--out", tmp_path / "a.mcap")
    ended = cdpr_here("import", "log", "planar-3", *files)
    assert ended.returncode == 2
    assert "cables.tensions: 2 columns; allowed: 3" in ended.stderr
    assert not (tmp_path / "a.mcap").exists()
