"""The check of a calibrated robot detects and names a single change, with synthetic readings."""

from __future__ import annotations

from contextlib import nullcontext
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from cdpr_profiles import load_robot
from cdpr_profiles.places import SHIPPED
from cdpr_rt.calibration.check import Check, check_geometry, require_spare_length
from cdpr_rt.calibration.parameters import CableGeometry
from cdpr_rt.calibration.readings import Observations
from cdpr_rt.calibration.residuals import encoder_lengths
from cdpr_rt.errors import InvalidRequestError
from tests.cdpr_rt.calibration.made_up import made_up


def checked(
    robot: str,
    *,
    cable: int = 0,
    exit_m: tuple[float, ...] = (0.0, 0.0, 0.0),
    drum: float = 0.0,
    home_m: tuple[float, ...] = (0.0, 0.0, 0.0),
    scanner_m: float | None = None,
    slip_m: float = 0.0,
    slip_from: int = 0,
) -> Check:
    """Return the check of a robot that differs from its file only by the arguments."""
    what = made_up(robot, 11, 4, exit_m=0.0, drum=0.0, elongation=0.0, home_first=True)
    k, changed = what.file.coordinates, np.zeros((what.file.n, 9))
    changed[cable, :k], changed[cable, 4] = exit_m[:k], drum
    poses = np.array([pose.array for pose in what.poses])
    poses[0, 0, :k] += home_m[:k]
    tension = what.seen.tension_N
    true = encoder_lengths(replace(what.file, cable=changed), poses, tension)
    rng = np.random.default_rng(4)
    # encoders start at the assumed lengths of home
    paid_out = (true - true[0]) / (1.0 + changed[:, 4]) + rng.normal(0.0, 1.5e-4, true.shape)
    told = encoder_lengths(what.file, what.seen.start[:1], tension[:1])[0] + paid_out
    told[slip_from:, cable] -= slip_m
    seen = Observations.of_lengths(told, tension, what.seen.start)
    if scanner_m is not None:
        p = poses[:, 0] + rng.normal(0.0, scanner_m, (len(poses), 3))
        p[:, k:] = np.nan
        seen = seen.with_positions(p, scanner_m)
    return check_geometry(what.file, seen, 5e-4)


@pytest.mark.parametrize("robot", ["spatial-8", "planar-4"])
def test_an_unchanged_robot_passes_even_if_slightly_off_on_its_stand(robot: str) -> None:
    for home_m in ((0.0, 0.0, 0.0), (0.002, -0.003, 0.001)):
        found = checked(robot, home_m=home_m)
        assert not found.moved and not found.changes
        assert found.verdict()[0].startswith("UNCHANGED: lengths at")


def test_a_moved_exit_point_is_reported_with_its_displacement() -> None:
    found = checked("spatial-8", cable=1, exit_m=(0.0, 0.0, 0.02))
    assert found.moved
    (change,) = found.changes
    assert (change.kind, change.cable) == ("exit", 1)
    np.testing.assert_allclose(change.size, (0.0, 0.0, 0.02), atol=0.006)
    assert "cable 2" in found.verdict()[1] and "pulley" in found.verdict()[1]


def test_cables_are_reported_by_the_names_of_their_axes(tmp_path: Path) -> None:
    text = (SHIPPED / "robots" / "spatial-8.toml").read_text()
    named = tmp_path / "named.toml"
    named.write_text(text.replace("[[axes]]", '[[axes]]\nname = "c1"', 1))
    found = checked(str(named), cable=0, exit_m=(0.0, 0.0, 0.02))
    assert found.verdict()[1].startswith("MOVED: the exit point of c1 (or cable 7) has moved")


@pytest.mark.parametrize("robot", ["spatial-8", "planar-4"])
def test_a_changed_drum_is_reported_and_certain_with_a_scanner(robot: str) -> None:
    by_lengths, with_scanner = (
        checked(robot, cable=2, drum=0.01, scanner_m=std) for std in (None, 1e-3)
    )
    for found in (by_lengths, with_scanner):
        assert found.moved
        assert found.changes[0].kind == "drum"
        assert 2 in (found.changes[0].cable, *found.changes[0].alike)
    (change,) = with_scanner.changes
    assert change.cable == 2 and not change.alike
    assert change.size[0] == pytest.approx(0.01, abs=0.002)
    assert change.effect_m > 1e-3


def test_the_effect_of_a_change_is_predicted_for_a_freely_turning_platform() -> None:
    """A fit of the file's geometry to the same readings is wrong by 4.3 mm at worst."""
    (change,) = checked("planar-3", drum=-0.008).changes
    assert (change.kind, change.cable) == ("drum", 0)
    assert change.effect_m == pytest.approx(4.3e-3, rel=0.3)


def test_a_cable_that_slips_during_the_check_is_reported_with_its_pose() -> None:
    found = checked("spatial-8", cable=1, slip_m=0.01, slip_from=6)
    (change,) = found.changes
    assert (change.kind, change.cable, change.pose) == ("slip", 1, 6)
    assert not change.alike
    assert abs(change.size[0]) == pytest.approx(0.01, abs=0.002)
    assert "cable 2 is" in found.verdict()[1] and "from pose 6 on" in found.verdict()[1]


def test_lengths_alone_cannot_check_a_robot_with_as_many_cables_as_degrees_of_freedom() -> None:
    with pytest.raises(InvalidRequestError, match="check it with a camera or --scanner"):
        checked("suspended-6")
    assert not checked("suspended-6", scanner_m=1e-3).moved


@pytest.mark.parametrize(
    ("robot", "spare"),
    [("suspended-6", False), ("spatial-8", True), ("planar-3", True), ("point-4", True)],
)
def test_a_robot_without_redundant_lengths_is_rejected_before_it_moves(
    robot: str, spare: bool
) -> None:
    with nullcontext() if spare else pytest.raises(InvalidRequestError, match="cannot check"):
        require_spare_length(CableGeometry.of(load_robot(robot)))
