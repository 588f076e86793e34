"""The `cdpr bench` commands complete and their figures are consistent. Timing is not judged."""

from __future__ import annotations

import json
import subprocess
import sys
from functools import partial
from itertools import repeat
from typing import Any

import pytest
from cdpr_here import cdpr_here

from cdpr_rt.model.tension_distribution import METHODS
from cdpr_tools.bench.cycle import CANOPEN, OURS
from cdpr_tools.bench.harness import Figures, Target, cost_rows, with_nothing_open


def bench(*arguments: str, here: bool = False) -> tuple[dict[str, Any], str]:
    """Return the JSON line and the text of one `cdpr bench` run.

    With `here`, run it in this process, which suits commands without cycles.
    """
    if here:
        run = cdpr_here("bench", *arguments, "--json")
    else:
        command = [sys.executable, "-m", "cdpr_tools.cli", "bench", *arguments, "--json"]
        run = subprocess.run(command, capture_output=True, text=True, timeout=300, check=False)
    assert run.returncode == 0, run.stderr
    return json.loads(run.stdout.splitlines()[-1]), run.stderr


def test_alternatives_take_turns_and_are_compared_with_the_first() -> None:
    order: list[str] = []
    ways = {
        name: with_nothing_open(repeat(partial(order.extend, [name] * size)))
        for name, size in (("one", 1), ("other", 20_000))
    }
    rows = cost_rows(ways, 3, 2, 1, (50.0, 100.0))
    assert list(dict.fromkeys(order)) == ["one", "other"]
    turns = [name for k, name in enumerate(order) if k == 0 or order[k - 1] != name]
    assert turns == ["one", "other"] * 2
    assert order.count("one") == 5  # three calls and a warm-up in each of two blocks
    assert rows["one"]["times ours"] == 1.0 < rows["other"]["times ours"]
    for row in rows.values():
        assert row["wall p50"] <= row["wall max"]


def test_figures_print_a_line_for_each_row_and_target() -> None:
    figures = Figures(
        "title",
        {"a": {"p50": 1.0}, "b": {"p50": 2.0, "late": 3}},
        {"fast": Target("how fast", 9.0, 10.0), "many": Target("how many", 9.0, 10.0, True)},
        more={"n": 4},
    )
    title, table, fast, many = figures.lines()
    columns, a, b = table.splitlines()
    assert (title, columns.split(), a.split(), b.split()) == (
        "title", ["p50", "late"], ["a", "1.0"], ["b", "2.0", "3"],
    )  # fmt: skip
    assert fast == "how fast: 9, target at most 10: reached"
    assert many == "how many: 9, target at least 10: MISSED"
    told = figures.as_json()
    assert told["targets"]["many"] == {"value": 9.0, "bound": 10.0, "reached": False}
    assert told["n"] == 4


def test_bench_cycle_exchanges_the_same_frames_with_either_library() -> None:
    """The bus counts SYNC, 8 TPDOs and 8 RPDOs. Our master adds its heartbeat."""
    # two blocks; the second is shorter
    figures, text = bench("cycle", "--cycles", "520")
    rows = figures["rows"]
    assert rows[CANOPEN]["frames"] == 17.0
    assert 17.0 <= rows[OURS]["frames"] < 17.1
    ratio = rows[CANOPEN]["CPU p50"] / rows[OURS]["CPU p50"]
    assert figures["targets"]["canopen_over_ours"]["value"] == pytest.approx(ratio, rel=0.01)
    assert text.count("reached") + text.count("MISSED") == 1


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("cycle", "--cycles", "0"), "--cycles"),
        (("control", "--robot", "bench-2"), "bench-2.toml: has no platform; allowed: a robot with"),
    ],
)
def test_invalid_input_prints_one_message(arguments: tuple[str, ...], message: str) -> None:
    done = cdpr_here("bench", *arguments)
    assert done.returncode == 2
    assert message in done.stderr
    assert "Traceback" not in done.stderr


def test_bench_bus_measures_each_library_on_each_bus() -> None:
    figures, text = bench("bus", "--exchanges", "20")
    rows = figures["rows"]
    for name in ("simbus", "socketcand", "slcan"):
        for way in ("ours", "python-can"):
            row = rows[f"{name}, {way}"]
            assert row["frames/s"] == pytest.approx(1e6 / row["wall mean"], rel=0.01)
    assert "socketcan" in text
    # a frame of 8 bytes has 22 characters, 220 us at 1 Mbaud, in both directions simultaneously
    assert rows["slcan, ours"]["wall p50"] > 110.0
    assert rows["simbus, python-can"]["CPU p50"] > rows["simbus, ours"]["CPU p50"]


def test_control_costs_less_than_numpy() -> None:
    figures, text = bench("control", "--robot", "planar-3", "--cycles", "500")
    assert "planar-3: 3 cables, 2 directions" in text
    assert figures["targets"]["ratio"]["value"] > 2.0


def test_kinematics_finds_each_pose_from_bad_starts() -> None:
    figures, _ = bench("kinematics", "--poses", "100", here=True)
    rows = figures["rows"]
    assert set(rows) == {
        f"{case}, {way}"
        for case in ("along a path", "10 deg off", "40 deg off")
        for way in ("ours", "SciPy")
    }
    assert all(row["found, %"] == 100.0 for name, row in rows.items() if name.endswith("ours"))


def test_each_tension_method_finds_tensions_at_the_same_poses() -> None:
    figures, _ = bench("tension", "--poses", "500", here=True)
    for robot in ("spatial-8", "suspended-8"):
        found = {
            name.removeprefix(f"{robot}, "): row["found, %"]
            for name, row in figures["rows"].items()
            if name.startswith(robot)
        }
        assert set(found) == {*METHODS, "DAQP", "OSQP"}
        assert len({found[method] for method in METHODS}) == 1
        assert 20.0 < found["minimum-norm"] < 95.0
        assert found["DAQP"] == pytest.approx(found["minimum-norm"], abs=0.2)
