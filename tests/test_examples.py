"""Each example runs unchanged and prints what its docstring promises."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

EXAMPLES = Path(__file__).parents[1] / "examples"
MOST_LINES = 60
PRINTED = {
    "move_a_robot.py": ["active at", "wrote "],
    "faults.py": [
        "refused: pose: position_m",
        "fault of limit 'drive'",
        "state fault",
        "state act",
    ],
    "own_controller.py": ["built-in controller: ", "PoseController: "],
    "own_program.py": ["circle: at most ", "ended: circle: at ", "active, hold at"],
    "own_tension_distribution.py": ["built-in: [", "near_wanted: [", "mm off"],
    "workspace.py": ["% of the grid can be held", "lowest tension", "wrote "],
    "drawing.py": ["drawing.csv: ", "drawing.nc: "],
    "teleoperate.py": ["mm at the end", "active, hold at"],
    "relative_moves_daemon.py": ["refused: pose: distance_m", "recorded", "the daemon has ended"],
}


def test_each_example_is_listed_here_and_has_at_most_60_lines() -> None:
    files = {path.name: path.read_text().count("\n") for path in EXAMPLES.glob("*.py")}
    assert files.keys() == PRINTED.keys()
    assert max(files.values()) <= MOST_LINES


@pytest.mark.long
@pytest.mark.parametrize("name", PRINTED)
def test_example_succeeds_and_prints_its_results(name: str, tmp_path: Path) -> None:
    done = subprocess.run(
        [sys.executable, str(EXAMPLES / name)],
        cwd=tmp_path,
        env={**os.environ, "XDG_RUNTIME_DIR": str(tmp_path), "XDG_STATE_HOME": str(tmp_path)},
        capture_output=True,
        text=True,
        timeout=300.0,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    for words in PRINTED[name]:
        assert words in done.stdout
    if name == "move_a_robot.py":
        assert (tmp_path / "move_a_robot.png").stat().st_size > 10_000
