"""Predictions of `cdpr robot show` for a broken cable are true of simulated robots."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from cdpr_profiles import load_robot
from cdpr_rt.core.states import LoopState
from cdpr_rt.diagnosis.predictions import SWING_S, CableLoss
from cdpr_rt.diagnosis.subject import Subject
from cdpr_tools.recordings.truth import read_pose_log
from tests.local_robot import local_robot
from tests.slower_robot import slower_robot

CUT = 12
MOST = 1.3
"""Ratio by which the truth may exceed the prediction."""
LEAST = 0.4
"""Least ratio of truth to prediction, since any large prediction would be on the safe side."""


@pytest.mark.parametrize(
    ("robot", "cable", "place_m"),
    [
        (load_robot("point-4").path, 0, (1.2, 1.0, 1.8)),
        (Path(__file__).parent / "robots" / "light-box.toml", 0, (0.2, -0.15, 0.8)),
    ],
    ids=lambda value: getattr(value, "stem", None),
)
def test_a_platform_swings_as_fast_and_as_far_as_predicted(
    robot: Path, cable: int, place_m: tuple[float, ...], tmp_path: Path
) -> None:
    slower = slower_robot(tmp_path, robot)
    predicted = CableLoss(Subject(load_robot(slower))).swing(cable, place_m)
    with local_robot(slower) as rig:
        rig.enable()
        rig.carry_out("tighten")
        rig.carry_out("pose", position_m=list(place_m))
        rig.run(1.5)
        first = rig.cycle + rig.machine.sync_offset
        rig.inject(cable, CUT, 1)
        rig._turn_until(lambda: rig.loop.busy, 1.0, "a reaction")
        rig._turn_until(lambda: not rig.loop.busy, 30.0, "the power off")
        assert rig.state is LoopState.FAULT
        log = read_pose_log(rig.truth_log)
    log = log[log["sync_index"] >= first]
    moved = log["position_m"] - log["position_m"][0]
    away = np.linalg.norm(moved, axis=1)
    aside = np.linalg.norm(moved[:, :2], axis=1)
    swing_m = away[log["time_s"] <= log["time_s"][0] + SWING_S].max()
    for true_m, told_m in (
        (swing_m, predicted.swing_m),
        (away.max(), predicted.away_m),
        (aside.max(), predicted.aside_m),
    ):
        assert LEAST * told_m < true_m < MOST * told_m
