"""The operator model: a trembling hand, a delayed view, and a stopping rule."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy import signal

from cdpr_profiles import load_robot
from cdpr_tools.errors import BadInputError, WorkFailedError
from cdpr_tools.teleop import experiment_trial as trial
from cdpr_tools.teleop.experiment_operator import (
    HandModel,
    OperatorParameters,
    Station,
)
from cdpr_tools.teleop.experiment_tables import spread_mm
from cdpr_tools.teleop.experiment_trial import (
    PACKET_S,
    Condition,
    PerfectRobot,
    centre_m,
    place_of,
    plane_of,
    points_of_perfect_robot,
    run_trial,
    targets_m,
)
from cdpr_tools.trials.directions import Directions, platform_of

ROBOT = load_robot("planar-3")
PLATFORM = platform_of(ROBOT)
OPERATOR = OperatorParameters()
OURS = Station()
OF_THE_THESIS = Station(clutch=False, steady=False)
CENTRE = centre_m(ROBOT, "A")


def hand_at_rest(seconds: float, **changes: float) -> np.ndarray:
    hand = HandModel(replace(OPERATOR, **changes), PACKET_S, np.random.default_rng(5))
    samples = []
    for _ in range(round(seconds / PACKET_S)):
        hand.step()
        samples.append(hand.measured_m)
    return np.array(samples)


def points(
    scale: float = 4.0, round_trip_s: float = 0.0, station: Station = OURS, runs: int = 2
) -> np.ndarray:
    return np.concatenate(
        [
            points_of_perfect_robot(
                PLATFORM, CENTRE, Condition("A", scale, round_trip_s, k), OPERATOR, station, 1
            )
            for k in range(runs)
        ]
    )


def test_a_hand_at_rest_trembles_between_8_and_12_hertz_and_wanders_slowly() -> None:
    """A spectrum by scipy shows both with the requested amplitudes."""
    x = hand_at_rest(600.0, master_step_m=1e-9)[:, 0]
    frequency, density = signal.welch(x, 1.0 / PACKET_S, nperseg=512)
    band = (frequency > 5.0) & (frequency < 15.0)
    power = density * (frequency[1] - frequency[0])
    assert np.sqrt(power[band].sum()) == pytest.approx(OPERATOR.tremor_m, rel=0.15)
    assert 8.0 < frequency[band][np.argmax(density[band])] < 12.0
    assert np.sqrt(power[frequency < 2.0].sum()) == pytest.approx(OPERATOR.drift_m, rel=0.25)


def test_all_targets_are_reached_in_order_and_the_parts_add_up_to_the_error() -> None:
    found = points()
    assert found["target"].tolist() == [*range(10)] * 2
    assert np.all(np.diff(found["pressed_s"].reshape(2, 10), axis=1) > 0.0)
    sum_m = found["judged_m"] + found["hand_m"] + found["robot_m"]
    assert sum_m == pytest.approx(found["error_m"], abs=1e-12)
    assert np.abs(found["error_m"]).max() < 4e-3


def test_with_the_clutch_the_hand_adds_no_error_before_the_confirmation() -> None:
    assert np.abs(points(scale=8.0, runs=1)["hand_m"]).max() < 1e-5


def test_without_clutch_the_error_of_the_hand_agrees_with_the_thesis() -> None:
    """In both, the variance grows by (0.18 mm * scale)^2."""
    spread_at = {
        scale: spread_mm(points(scale, 0.0, OF_THE_THESIS)["hand_m"]).mean() for scale in (2, 8)
    }
    hand_mm = np.sqrt((spread_at[8] ** 2 - spread_at[2] ** 2) / (8.0**2 - 2.0**2)) / 3.0
    assert 0.09 < hand_mm < 0.27


def test_delay_costs_time_but_no_precision() -> None:
    slow, quick = points(4.0, 0.73), points(4.0, 0.0)
    assert slow["pressed_s"].max() > 1.4 * quick["pressed_s"].max()
    assert spread_mm(slow["error_m"]).max() < 1.6 * spread_mm(quick["error_m"]).min()


def test_the_same_seed_gives_the_same_run() -> None:
    once = points(runs=1)
    assert once.tobytes() == points(runs=1).tobytes()
    other = points_of_perfect_robot(
        PLATFORM, CENTRE, Condition("A", 4.0, 0.0, 0), OPERATOR, OURS, 2
    )
    assert not np.array_equal(other["error_m"], once["error_m"])


def test_a_run_with_a_robot_that_does_not_move_is_aborted(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(trial, "LONGEST_S", 20.0)

    class Stuck(PerfectRobot):
        def send(self, *_: object) -> None:
            pass

    with pytest.raises(WorkFailedError, match="target 1 was not confirmed"):
        run_trial(
            Stuck(PLATFORM, CENTRE),
            Condition("A", 4.0, 0.0, 0),
            targets_m(CENTRE),
            OPERATOR,
            OURS,
            1,
        )


def test_a_workspace_too_small_for_the_pattern_is_reported() -> None:
    narrow = replace(PLATFORM, workspace_min_m=(-0.2, 1.4))
    with pytest.raises(BadInputError, match="place B of the pattern needs"):
        centre_m(replace(ROBOT, platform=narrow), "B")
    with pytest.raises(BadInputError, match="allowed: A, B, C"):
        centre_m(ROBOT, "D")


def test_the_pattern_in_space_is_vertical_in_the_middle_of_the_depth():
    robot = load_robot("suspended-8")
    directions = Directions.of(platform_of(robot))
    centre = centre_m(robot, "B")
    place = place_of(directions, centre)
    low, high = directions.low_m, directions.high_m
    assert place[:3] == pytest.approx(
        [0.5 * (low[0] + high[0]) - 0.2 * (high[0] - low[0]), 0.5 * (low[1] + high[1]),
         0.75 * low[2] + 0.25 * high[2]]
    )  # fmt: skip
    assert place[3:].tolist() == [0.0, 0.0, 0.0]
    assert place[list(plane_of(3))] == pytest.approx(centre)
