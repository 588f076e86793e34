"""The selection of motors to commission."""

from __future__ import annotations

from pathlib import Path

import pytest

from cdpr_profiles import load_robot
from cdpr_tools.commands.commission import chosen_axes
from cdpr_tools.errors import BadInputError


def test_motors_to_commission_are_selected_by_name(tmp_path: Path) -> None:
    robot = load_robot("planar-3")
    everything = chosen_axes(robot, (), True, tmp_path)
    assert [motor.winch.node_id for motor in everything] == [1, 2, 3]
    one = chosen_axes(robot, ("lower", "lower"), False, tmp_path)
    assert [motor.paths.out for motor in one] == [tmp_path / "lower"]
    for names, every in (((), False), (("lower",), True)):
        with pytest.raises(BadInputError, match="'upper left', 'upper right', 'lower'"):
            chosen_axes(robot, names, every, tmp_path)
    with pytest.raises(BadInputError, match=r"--axis left: not an axis of .*'upper left'"):
        chosen_axes(robot, ("left",), False, tmp_path)
