"""Figures of a robot are worded so that they do not mislead."""

from __future__ import annotations

import re
from pathlib import Path

from cdpr_profiles import load_robot
from cdpr_profiles.places import SHIPPED
from cdpr_rt.diagnosis.subject import Subject
from cdpr_tools.robots.summary import figures, lines


def test_no_rotation_is_reported_for_a_point_in_a_plane(tmp_path: Path) -> None:
    text = (SHIPPED / "robots" / "planar-3.toml").read_text()
    path = tmp_path / "point.toml"
    path.write_text(re.sub(r"anchor_point_m = .*", "anchor_point_m = [0.0, 0.0]", text))
    robot = load_robot(path)
    assert robot.platform is not None
    told = figures(Subject(robot))
    assert told["turns_at_most_rad"] == 0.0 and told["free_rotation"] is None
    assert not any("turns" in line for line in lines(Subject(robot), told))


def test_a_share_just_below_100_percent_is_not_rounded_to_100() -> None:
    robot = load_robot("planar-3")
    assert robot.platform is not None
    told = figures(Subject(robot)) | {"target_share": 0.997}
    assert any("accepted in 99 % of it" in line for line in lines(Subject(robot), told))


def test_the_summary_tells_whether_a_slipping_cable_is_detected() -> None:
    for name, allowed, text in (
        ("spatial-8", True, "more than 27.5 mm end a motion"),
        ("suspended-6", False, "a cable that slips but stays tight is not noticed"),
    ):
        robot = load_robot(name)
        assert robot.platform is not None
        told = figures(Subject(robot))
        assert (told["lengths_disagree_m"] is not None) is allowed
        shown = lines(Subject(robot), told)
        assert any(text in line for line in shown)
        slips = [axis["slip"] for axis in told["axes"]]
        assert all((slip["unnoticed_m"] is not None) is allowed for slip in slips)
        assert any(" per mm" in line for line in shown) is not allowed
