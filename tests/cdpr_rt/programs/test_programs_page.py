"""The page on programs lists every program and key."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

from cdpr_profiles import load_robot
from cdpr_rt.core.estimate import Estimator
from cdpr_rt.core.shared_block import SharedBlock
from cdpr_rt.model.robot_arrays import limits_of, winches_of
from cdpr_rt.programs.base import Program, ProgramError
from cdpr_rt.programs.model import model_of
from cdpr_rt.programs.registry import build_programs, platform_parts

PAGE = Path(__file__).parents[3] / "docs" / "reference" / "programs.md"
OF_ANGLES = {"rotation_rad", "turn_rad"}
"""Keys of robots with controlled angles, which `planar-3` does not have."""


def tables() -> list[dict[str, set[str]]]:
    """Return the keys by program of each table of the page."""
    found: list[dict[str, set[str]]] = []
    for line in PAGE.read_text().splitlines():
        cells = [cell.strip() for cell in line.strip("|").split("|")]
        if cells[0] == "program":
            found.append({})
        elif found and (name := re.fullmatch(r"`([a-z]+)`", cells[0])):
            keys = set(re.findall(r"`([a-z_A-Z]+_[a-zA-Z_]+|[a-z]+)`", cells[1].split(": `")[0]))
            found[-1][name[1]] = found[0][name[1]] if cells[1] == "as above" else keys
    return found


def programs(robot_name: str) -> dict[str, Program]:
    robot = load_robot(robot_name)
    axes, limits = robot.axes, limits_of(robot)
    n = len(axes)
    model = model_of(axes, 1e-3, [2.3e-3] * n, limits)
    estimator = Estimator(n, 1e-3, winches_of(axes))
    parts = platform_parts(robot, limits, model, estimator)
    return build_programs(model, SharedBlock.create(n, 1.0, 1000.0), parts)


@pytest.mark.parametrize(("robot", "number"), [("bench-2", 0), ("planar-3", 1)])
def test_the_page_has_every_program_and_key(robot: str, number: int) -> None:
    page, built = tables()[number], programs(robot)
    assert set(page) == set(built)
    for name, program in built.items():
        with pytest.raises(ProgramError, match=r"key '.*'; allowed: ") as refused:
            program.check({"no_such_key": np.nan})
        told = str(refused.value).partition("allowed: ")[2]
        known = set() if told.startswith("none") else set(told.split(", "))
        assert known == page[name] - OF_ANGLES, name
