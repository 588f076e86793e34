"""The platform of a robot's file: what it may say, and what is refused with which key."""

from __future__ import annotations

from pathlib import Path

import pytest

from profiles import ProfileError, load_robot
from profiles.catalogue import SHIPPED

PLANAR = (SHIPPED / "robots" / "planar-3.toml").read_text()


def changed(folder: Path, *replaced: tuple[str, str]) -> Path:
    text = PLANAR
    for old, new in replaced:
        assert old in text
        text = text.replace(old, new)
    path = folder / "mine.toml"
    path.write_text(text)
    return path


def test_the_shipped_platform_hangs_on_three_cables() -> None:
    platform = load_robot("planar-3").platform
    assert platform is not None and platform.is_planar
    assert len(platform.exit_points_m) == len(platform.anchor_points_m) == 3
    sides = [
        sum((a - b) ** 2 for a, b in zip(p, q, strict=True)) ** 0.5
        for p in platform.anchor_points_m
        for q in platform.anchor_points_m
        if p != q
    ]
    assert sides == pytest.approx([0.15] * 6, abs=1e-4)  # the thesis' triangle


@pytest.mark.parametrize(
    ("replaced", "key", "problem"),
    [
        (("exit_point_m = [0.0, 0.0]\n", ""), "axes[2].exit_point_m", "missing"),
        (("[0.0, 0.0]", "[0.0, 0.0, 0.0]"), "axes[2].exit_point_m", "allowed: 2, as platform"),
        (("[0.0, 0.0]", "[0.0, 2000.0]"), "axes[2].exit_point_m[1]", "-1000 to 1000, in metres"),
        (("home_m = [0.0, 1.3]", "home_m = [0.7, 1.3]"), "platform.home_m[0]", "-0.6 to 0.6"),
        (("home_m = [0.0, 1.3]", "home_m = [0.0, 2.5]"), "platform.home_m[1]", "up to 2.4"),
        (("max_m = [0.6, 2.4]", "max_m = [0.6, 1.4]"), "platform.workspace_max_m[1]", "above 1.4"),
        (("max_m = [0.6, 2.4]", "max_m = [0.6]"), "platform.workspace_max_m", "2 or more entries"),
        (("mass_kg = 2.0", "mass_kg = 0.0"), "platform.mass_kg", "greater than 0"),
        (("mass_kg = 2.0", "mass_kg = nan"), "platform.mass_kg", "finite number"),
        (("mass_kg", "mas_kg"), "platform.mas_kg", "did you mean 'mass_kg'?"),
        (("tension_min_N = 20.0\n", "\n"), "limits.tension_min_N", "where there is a [platform]"),
    ],
)
def test_what_no_platform_can_be_is_refused(
    tmp_path: Path, replaced: tuple[str, str], key: str, problem: str
) -> None:
    changes = [replaced]
    if key == "limits.tension_min_N":
        changes.append(("slack_N = 3.0\n", ""))
    path = changed(tmp_path, *changes)
    with pytest.raises(ProfileError) as caught:
        load_robot(path)
    assert (caught.value.file, caught.value.key) == (str(path), key)
    assert problem in str(caught.value)


def test_points_without_a_platform_and_cables_too_few_are_refused(tmp_path: Path) -> None:
    start, end = PLANAR.index("[platform]"), PLANAR.index("[limits]")
    path = tmp_path / "mine.toml"
    path.write_text(PLANAR[:start] + PLANAR[end:])
    with pytest.raises(ProfileError, match=r"axes\[0\]: .*along with \[platform\]"):
        load_robot(path)
    path.write_text(PLANAR[: PLANAR.rindex("[[axes]]")])
    with pytest.raises(ProfileError, match="axes: 2; allowed: 3 and more"):
        load_robot(path)


def test_a_stand_may_be_under_the_box_or_in_it(tmp_path: Path) -> None:
    for y_m in (0.2, 1.4, 2.4):
        path = changed(tmp_path, ("home_m = [0.0, 1.3]", f"home_m = [0.0, {y_m}]"))
        platform = load_robot(path).platform
        assert platform is not None and platform.home_m == (0.0, y_m)


def test_what_was_commissioned_is_found_beside_the_robots_file(tmp_path: Path) -> None:
    (tmp_path / "motors" / "left").mkdir(parents=True)
    name = 'name = "upper left"'
    path = changed(tmp_path, (name, f'{name}\ncommissioned = "motors/left"'))
    first, second, _ = load_robot(path).axes
    assert (first.commissioned, second.commissioned) == (tmp_path / "motors" / "left", None)
