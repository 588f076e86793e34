"""Figures of each trial for synthetic motion with known figures."""

import numpy as np
import pytest

from cdpr_profiles import load_robot
from cdpr_tools.trials import limits, line, streaming, targets
from cdpr_tools.trials.figures import Figure, all_reached
from tests.tools.trials.made_up_trial import PERIOD_S, recorded

ROBOT = load_robot("planar-3")
REACH = np.array([0.3, 2.0])


def figures_of(found: list[Figure]) -> dict[str, Figure]:
    return {figure.key: figure for figure in found}


@pytest.mark.parametrize(("value", "at_least", "reached"), [(1.0, False, True), (1.1, False, False),
                         (1.0, True, True), (0.9, True, False), (np.nan, False, False),
                         (np.nan, True, False)])  # fmt: skip
def test_a_target_is_reached_up_to_and_including_its_limit(value, at_least, reached):
    figure = Figure("key", "text", value, "mm", 1.0, at_least)
    assert figure.reached is reached
    assert all_reached([figure]) is reached
    assert (figure.row()[-1] == "reached") is reached


def test_errors_at_targets_are_those_at_the_end_of_the_stay():
    errors = np.array([[0.5, 0.2], [-0.3, -0.1], [0.4, 0.2]]) * 1e-3
    goals = np.array([[0.1, 1.5], [0.2, 1.6], [0.3, 1.7]])
    true = np.repeat(goals + 0.02, 300, axis=0)
    marks = []
    for k in range(3):
        true[300 * k + 150 : 300 * (k + 1)] = goals[k] + errors[k]
        marks.append({"mark": "measured", "target_m": goals[k].tolist(), "row": 300 * k + 299})
    found = figures_of(targets.judge(recorded(true, true, marks)))
    assert found["mean_x_mm"].value == pytest.approx(0.2)
    assert found["mean_y_mm"].value == pytest.approx(0.1)
    assert found["three_sigma_x_mm"].value == pytest.approx(3e3 * errors[:, 0].std(ddof=1))
    assert found["three_sigma_y_mm"].value == pytest.approx(3e3 * errors[:, 1].std(ddof=1))
    assert found["mean_x_mm"].reached
    assert not found["three_sigma_x_mm"].reached


def slanted(ripple_m: float) -> object:
    """Return motion along (3, 4) / 5 that oscillates across it and lags 1 mm behind."""
    along, across = np.array([0.6, 0.8]), np.array([-0.8, 0.6])
    way = np.linspace(0.0, 0.5, 5000)[:, None]
    setpoint = REACH + way * along
    true = setpoint - 1e-3 * along + ripple_m * np.sin(200.0 * way) * across
    ends = {"from_m": setpoint[0].tolist(), "to_m": setpoint[-1].tolist()}
    return recorded(true, setpoint, [{"mark": "line", **ends}, {"mark": "line end", "row": 5000}])


def test_the_error_of_a_line_is_the_distance_from_it():
    parts = {line.WITH: slanted(1e-3), line.WITHOUT: slanted(4e-3)}
    found = figures_of(line.judge(parts, line.SPEED_m_s))
    assert found["path_with_mm"].value == pytest.approx(1.0 / np.sqrt(2.0), rel=0.01)
    assert found["path_without_mm"].value == pytest.approx(4.0 / np.sqrt(2.0), rel=0.01)
    assert found["path_ratio"].value == pytest.approx(4.0, rel=0.01)
    expected = np.sqrt((8.0 + 1.0) / (0.5 + 1.0))  # both contain the lag
    assert found["setpoint_ratio"].value == pytest.approx(expected, rel=0.01)
    assert not found["setpoint_ratio"].reached
    expected = np.sqrt(8.0 / 0.5)
    assert found["setpoint_less_mean_ratio"].value == pytest.approx(expected, rel=0.01)
    assert "path_ratio" not in figures_of(
        line.judge({line.WITHOUT: parts[line.WITHOUT]}, line.SPEED_m_s)
    )


def leg_of(over_m: float, **truth: np.ndarray) -> object:
    """Return a leg of 0.5 m from rest whose target the platform passes by `over_m`."""
    way = np.concatenate([np.zeros(10), np.linspace(0.0, 1.0, 990)])
    setpoint = REACH + np.outer(way, [-0.5, 0.0])
    true = setpoint.copy()
    true[990:, 0] -= over_m
    true[500:, 1] += 4e-3
    goal = [-0.2, 2.0]
    return recorded(true, setpoint, [{"mark": "leg", "target_m": goal, "row": 2}], **truth)


@pytest.mark.parametrize("over_m", [0.0, 1.5e-3, 3e-3])
def test_overshoot_is_the_distance_beyond_the_target(over_m):
    found = figures_of(limits.judge(leg_of(over_m), ROBOT))
    assert found["overshoot_mm"].value == pytest.approx(1e3 * over_m, abs=1e-6)
    assert found["overshoot_mm"].reached is (over_m <= 2e-3)
    assert found["off_mm"].value == pytest.approx(4.0)  # in y, where there was no motion


@pytest.mark.parametrize(("rests_s", "over_mm"), [(0.4, None), (0.6, 1.5)])
def test_overshoot_of_rest_excludes_the_error_at_rest(rests_s, over_mm):
    way = np.concatenate([np.linspace(0.0, 1.0, 1000), np.ones(round(rests_s / PERIOD_S))])
    setpoint = REACH + np.outer(way, [-0.5, 0.0])
    true = setpoint - [2e-3, 0.0] * (way > 0.999)[:, None]
    true[1000:1100, 0] -= 1.5e-3
    goal = [-0.2, 2.0]
    marks = [{"mark": "leg", "target_m": goal, "row": 2}]
    found = figures_of(limits.judge(recorded(true, setpoint, marks), ROBOT))
    assert found["overshoot_mm"].value == pytest.approx(3.5)
    assert ("overshoot_of_rest_mm" in found) == (over_mm is not None)
    if over_mm is not None:
        assert found["overshoot_of_rest_mm"].value == pytest.approx(over_mm)
        assert found["overshoot_of_rest_mm"].limit is None


def test_braking_after_a_changed_target_does_not_count_as_overshoot():
    speed, acceleration = 0.4, ROBOT.platform.acceleration_m_s2
    time_s = np.arange(600) * PERIOD_S
    way = np.where(time_s < 0.2, speed * time_s, 0.0)
    braking = np.minimum(time_s[200:] - 0.2, speed / acceleration)
    way[200:] = 0.2 * speed + speed * braking - 0.5 * acceleration * braking**2
    true = REACH + np.outer(way, [0.0, -1.0])
    near = [REACH[0], REACH[1] - 0.2 * speed - 0.01]
    marks = [
        {"mark": "leg", "target_m": [REACH[0], 1.5], "row": 2},
        {"mark": "leg", "target_m": near, "row": 200},
    ]
    made = recorded(true, true, marks)
    assert figures_of(limits.judge(made, ROBOT))["overshoot_mm"].value < 0.5
    late = recorded(true - [0.0, 0.003] * (time_s > 0.3)[:, None], true, marks)
    assert figures_of(limits.judge(late, ROBOT))["overshoot_mm"].value > 2.5


@pytest.mark.parametrize(("tension_N", "key"), [(19.9, "tension_min_N"), (150.1, "tension_max_N"),
                         (2.0, "slack_cycles")])  # fmt: skip
def test_a_single_cycle_out_of_bounds_counts(tension_N, key):
    tension = np.full((1000, 3), 60.0)
    assert all_reached(limits.judge(leg_of(0.0, tension_N=tension), ROBOT))
    tension[777, 1] = tension_N
    found = figures_of(limits.judge(leg_of(0.0, tension_N=tension), ROBOT))
    assert found["outside_cycles"].value == 1
    assert not found["outside_cycles"].reached
    assert not found[key].reached


@pytest.mark.parametrize(("times", "reached"), [(0.99, True), (1.05, False)])
def test_a_step_of_the_commanded_velocity_is_found(times, reached):
    allowed = ROBOT.platform.acceleration_m_s2 * PERIOD_S
    velocity = np.zeros((400, 2))
    velocity[200:, 1] = times * allowed
    setpoint = np.round(REACH + np.cumsum(velocity * PERIOD_S, axis=0), 9)  # as recorded
    counts = {"sent": 50, "lost": 10, "doubled": 5, "overtaken": 7}
    found = figures_of(
        streaming.judge(recorded(setpoint, setpoint, [{"mark": "network", **counts}]))
    )
    assert found["step_mm_s"].value == pytest.approx(1e3 * times * allowed, abs=2e-3)
    assert found["step_mm_s"].reached is reached
    assert found["lost"].value == pytest.approx(20.0)
