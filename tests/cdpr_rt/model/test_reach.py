"""How far straight lines reach, compared with brute force and other margins; rejected starts."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from cdpr_profiles import load_robot
from cdpr_profiles.platform import BoxFile
from cdpr_rt.errors import GeometryError
from cdpr_rt.model import reachable
from cdpr_rt.model.platform_model import PlatformModel, platform_model, platform_model_of
from cdpr_rt.model.reachable import CONTACT, NOT_HELD, SHARE, WHOLE, Reach

PLACES = 60
LAMP = BoxFile(min_m=(-0.2, 0.05, 1.98), max_m=(-0.1, 0.15, 2.05))


def model_of(name: str) -> PlatformModel:
    return platform_model_of(load_robot(name))


def changed(name: str, **changes: object) -> PlatformModel:
    """Return the model of a shipped robot with changes to its platform."""
    model = model_of(name)
    platform = replace(model.platform, **changes)  # type: ignore[arg-type]
    return platform_model(platform, model.low_N, model.high_N)


def askew() -> PlatformModel:
    """Return an unusual robot: irregular exit points, off balance, a lamp above."""
    rng = np.random.default_rng(7)
    platform = load_robot("spatial-8").platform
    assert platform is not None
    exits = np.array(platform.exit_points_m) + rng.uniform(-0.2, 0.2, (8, 3))
    return changed(
        "spatial-8", exit_points_m=tuple(map(tuple, exits)), mass_kg=7.0, clearance_m=0.012,
        centre_of_mass_m=(0.01, -0.015, 0.03), home_rotation_rad=(0.02, 0.0, -0.03),
        inertia_kg_m2=(0.2, 0.25, 0.05, 0.01, 0.0, -0.01), obstacles=(LAMP,),
    )  # fmt: skip


def on_pulleys() -> PlatformModel:
    return changed("spatial-8", pulley_radius_m=(0.04,) * 8)


def off_balance() -> PlatformModel:
    return changed(
        "planar-4", centre_of_mass_m=(0.02, -0.03), home_rotation_rad=(0.05,), clearance_m=0.02,
        obstacles=(BoxFile(min_m=(0.5, 1.75), max_m=(0.6, 1.8)),),
    )  # fmt: skip


MODELS = {
    "spatial-8": lambda: model_of("spatial-8"),
    "pulleys": on_pulleys,
    "askew": askew,
    "suspended-6": lambda: model_of("suspended-6"),
    "planar-4": off_balance,
    "planar-3": lambda: model_of("planar-3"),
    "point-4": lambda: model_of("point-4"),
    "suspended-8": lambda: model_of("suspended-8"),
}


def wild_ends(model: PlatformModel, count: int) -> np.ndarray:
    rng = np.random.default_rng(14)
    low, high = np.array(model.platform.workspace_min_m), np.array(model.platform.workspace_max_m)
    half, k = 0.8 * (high - low), model.positions
    ends = np.zeros((count, model.size))
    ends[:, :k] = 0.5 * (low + high) + rng.uniform(-half, half, (count, k))
    ends[:, k:] = rng.uniform(-0.6, 0.6, (count, model.size - k))
    return ends


@pytest.mark.parametrize("name", MODELS)
def test_ways_are_feasible_and_clear_up_to_their_end_and_not_beyond(name: str) -> None:
    model = MODELS[name]()
    reach, workspace = Reach(model), model.workspace()
    ends = wild_ends(model, 25)
    shares, why = reach.shares(ends)
    assert ((shares == 1.0) == (why == WHOLE)).all()
    assert (why != WHOLE).any()
    for end, share, reason in zip(ends, shares, why, strict=True):
        places = np.linspace(0.0, share, PLACES)[:, None]
        poses = model.poses(reach.start + places * (end - reach.start))
        margins, _ = workspace.margins(poses)
        assert margins.min() >= -1e-6
        clearances, _ = model.interference.clearances(poses)
        assert clearances.min() >= model.platform.clearance_m - 1e-8
        if reason == WHOLE:
            continue
        further = model.poses((reach.start + (share + 1e-3) * (end - reach.start))[None])
        if reason == NOT_HELD:
            assert workspace.margins(further)[0][0] < 0.01
        else:
            assert reason == CONTACT
            assert model.interference.clearances(further)[0][0] < model.platform.clearance_m + 1e-5


def test_drawn_poses_are_in_the_box_within_the_angle_and_reproducible() -> None:
    model = model_of("spatial-8")
    reach = Reach(model)
    once, again, other = (reach.draw(50, seed, 0.1) for seed in (3, 3, 4))
    assert np.array_equal(once.positions, again.positions)
    assert not np.array_equal(once.positions, other.positions)
    p, turned = once.positions[:, :3], np.linalg.norm(once.positions[:, 3:], axis=1)
    platform = model.platform
    assert (p >= platform.workspace_min_m).all() and (p <= platform.workspace_max_m).all()
    assert 0.05 < turned.max() <= 0.1
    assert once.drawn == 50 and (once.shares == 1.0).all()
    assert not reach.draw(3, 1, 0.0).positions[:, 3:].any()


def test_a_way_that_ends_early_contributes_its_first_part() -> None:
    model = changed("spatial-8", obstacles=(LAMP,))
    reach = Reach(model)
    drawn = reach.draw(200, 1)
    assert drawn.cut_by_contact > 5 and drawn.cut_by_tensions == 0
    cut = drawn.shares < 1.0
    assert cut.any() and (drawn.shares[cut] <= SHARE).all()
    assert len(drawn.positions) + drawn.outside == drawn.drawn
    clearances, _ = model.interference.clearances(model.poses(drawn.positions))
    assert clearances.min() >= model.platform.clearance_m


def test_a_start_without_any_way_is_rejected_with_the_reason(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(reachable, "_MOST_DRAWN", 1)
    model = model_of("spatial-8")
    with pytest.raises(
        GeometryError, match=r"start at 1\.500, 0\.000, 1\.500 m: cable \d would need"
    ):
        Reach(model, np.array([1.5, 0.0, 1.5, 0.0, 0.0, 0.0]))
    low, high = (tuple(np.array(model.platform.home_m) + s * 0.05) for s in (-1, 1))
    inside = changed("spatial-8", obstacles=(BoxFile(min_m=low, max_m=high),))
    with pytest.raises(GeometryError, match="platform and obstacle 1 touch"):
        Reach(inside)
    caged = changed("spatial-8", workspace_min_m=(5.0, 5.0, 1.4), workspace_max_m=(5.1, 5.1, 1.5))
    with pytest.raises(GeometryError, match="ways lead to a pose; wanted: 2"):
        Reach(caged).draw(2, 1)


def test_a_robot_with_three_redundant_cables_is_rejected() -> None:
    model = model_of("planar-3")
    platform = model.platform
    more = replace(
        platform,
        exit_points_m=(*platform.exit_points_m, (-0.5, 0.0), (0.5, 3.0)),
        anchor_points_m=(*platform.anchor_points_m, (0.0, 0.0), (0.0, 0.0)),
        pulley_radius_m=(),
        pulley_axes=(),
        cable_weights_N_m=(),
    )
    with pytest.raises(GeometryError, match="5 cables; allowed: up to 4 to control 2 directions"):
        Reach(platform_model(more, np.full(5, 20.0), np.full(5, 200.0)))


def test_drawn_poses_keep_a_turned_platform_above_its_stand() -> None:
    name = "suspended-8"
    platform = model_of(name).platform
    up = len(platform.home_m) - 1
    low = [*platform.workspace_min_m[:up], platform.home_m[up] + 0.005]
    model = changed(name, workspace_min_m=tuple(low))
    start = model.home.copy()
    start[: up + 1] = 0.5 * (np.array(low) + platform.workspace_max_m)
    poses = model.poses(Reach(model, start).draw(200, 3).positions)
    anchors = model.kinematics.geometry[3:6].T
    home = model.home_pose
    stand_m = (home.p + anchors @ home.Q.T)[:, up].min()
    for pose in poses:
        assert (pose[0] + anchors @ pose[1:].T)[:, up].min() > stand_m
    below = changed(name, workspace_min_m=(*low[:up], platform.home_m[up] - 0.1))
    # a robot whose targets reach below home does not stand on a floor there
    lowest = Reach(below, start).draw(200, 3).positions[:, up].min()
    assert lowest < platform.home_m[up]
