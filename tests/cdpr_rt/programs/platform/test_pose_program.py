"""A platform's set-point: straight ways, a hand that leads, and what it must not do."""

from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cdpr_profiles import load_robot
from cdpr_profiles.platform import Platform
from cdpr_rt.core.estimate import Estimator
from cdpr_rt.core.exchange import AxisFeedback, Setpoint
from cdpr_rt.core.shared_block import SAMPLE, SharedBlock
from cdpr_rt.motion.pose_stream import PoseStream
from cdpr_rt.motion.stream_buttons import CLUTCH
from cdpr_rt.programs.base import ProgramError
from cdpr_rt.programs.platform.platform_program import PlatformParts
from cdpr_rt.programs.platform.pose import PoseProgram
from cdpr_rt.robots.platform.cable_control import CableControl
from cdpr_rt.robots.platform_model import platform_model
from cdpr_rt.robots.robot_arrays import winches_of

PERIOD_S = 1e-3
ROBOT = load_robot("planar-3")
SPEED_m_s, ACCELERATION_m_s2 = 0.5, 2.0


class Ideal:
    """A platform that is where its set-point is, and a hand whose packets come at once."""

    def __init__(self, platform: Platform | None = None) -> None:
        self.platform = platform or ROBOT.platform
        assert self.platform is not None
        model = platform_model(self.platform, np.full(3, 20.0), np.full(3, 150.0))
        axes = list(ROBOT.axes)
        self.control = CableControl(model, axes, np.full(3, 4.5), PERIOD_S)
        self.parts = PlatformParts(
            model, self.control, Estimator(3, PERIOD_S, winches_of(axes)), PERIOD_S
        )
        self.block = SharedBlock.create(3, 1.0, 1000.0)
        self.program = PoseProgram(self.parts, np.full(3, 4.5), PoseStream(self.block, PERIOD_S))
        self.feedback, self.setpoint, self.torque = AxisFeedback(3), Setpoint(3), np.zeros(3)
        self.feedback.valid[:] = True
        self.sample = np.zeros((), SAMPLE)
        self.sample["quaternion"], self.sample["session"] = (1.0, 0.0, 0.0, 0.0), 1
        self.restart()

    def restart(self, position_m: np.ndarray | None = None) -> None:
        """Begin anew, in the middle of the box or elsewhere."""
        assert self.platform is not None
        middle = 0.5 * np.add(self.platform.workspace_min_m, self.platform.workspace_max_m)
        middle = middle if position_m is None else position_m
        ways = middle + np.array(self.platform.anchor_points_m) - self.platform.exit_points_m
        self.feedback.position_rad[:] = 0.0
        self.parts.estimator.set_lengths(np.zeros(3), np.linalg.norm(ways, axis=1))
        self.parts.estimator.update(self.feedback)
        self.parts.cycle = -2
        self.parts.tight = True
        self.program.start(self.feedback, self.setpoint, self.torque)
        self.control.position[:] = middle
        self.control._shape_anew()
        self.program.command({})
        self.stretch_rad = np.zeros(3)
        self.path = [self.control.position.copy()]
        self.paces = [np.zeros(2)]
        self.shaped = [self.control.shaped.copy()]
        self.now_ms = 0

    def cycle(self) -> None:
        self.feedback.cycle += 1
        self.now_ms += 1
        self.program.update(self.feedback, self.setpoint, self.torque)
        self.feedback.position_rad[:] = self.setpoint.position_rad + self.stretch_rad
        self.path.append(self.control.position.copy())
        self.paces.append(self.control.velocity.copy())
        self.shaped.append(self.control.shaped.copy())

    def run(self, seconds: float) -> None:
        for _ in range(round(seconds / PERIOD_S)):
            self.cycle()

    def until_rest(self) -> None:
        for _ in range(20_000):
            self.cycle()
            if self.program.at_rest:
                return
        raise AssertionError("does not come to rest")

    def post(self, x: float, y: float, scale: float = 1.0, buttons: int = 0) -> None:
        """Post where the hand is now."""
        self.sample["sequence"] += 1
        self.sample["sent_ns"] = 1_000_000 * self.now_ms
        self.sample["position_m"] = (x, y, 0.0)
        self.sample["scale"], self.sample["buttons"] = scale, buttons
        self.block.post_sample(self.sample[()])

    def lead(self, hand: np.ndarray, scale: float = 1.0, buttons: int = 0, each: int = 20) -> None:
        """Move the hand along positions (k, 2), one every `each` cycles."""
        for x, y in hand:
            self.post(float(x), float(y), scale, buttons)
            for _ in range(each):
                self.cycle()

    def check_motion(self) -> None:
        """Nothing steps: velocity and acceleration keep their bounds, in the shaped motion too."""
        paces = np.array(self.paces)
        assert np.abs(paces).max() <= SPEED_m_s * (1 + 1e-9)
        most = ACCELERATION_m_s2 * PERIOD_S
        assert np.abs(np.diff(paces, axis=0)).max() <= most * (1 + 1e-9) + 1e-12
        shaped = np.diff(np.array(self.shaped), axis=0) / PERIOD_S
        assert np.abs(shaped).max() <= SPEED_m_s * (1 + 1e-6)
        assert np.abs(np.diff(shaped, axis=0)).max() <= most * (1 + 1e-6)


@pytest.fixture(scope="module")
def made() -> Ideal:
    return Ideal()


@pytest.fixture
def robot(made: Ideal) -> Ideal:
    made.restart()
    return made


def test_the_way_is_straight_and_ends_at_the_target(robot: Ideal) -> None:
    start, target = robot.path[0], np.array([0.45, 2.1])
    robot.program.command({"position_m": target.tolist()})
    robot.until_rest()
    robot.run(0.1)
    robot.check_motion()
    assert robot.control.shaped == pytest.approx(target, abs=1e-9)
    along = (target - start) / np.linalg.norm(target - start)
    for path in (np.array(robot.path), np.array(robot.shaped)):
        across = (path - start) @ np.array([-along[1], along[0]])
        assert np.abs(across).max() < 1e-6
        assert ((path - target) @ along).max() < 1e-9, "nothing overshoots"


def test_a_motion_is_done_when_the_platform_is_there_not_its_set_point(robot: Ideal) -> None:
    robot.program.command({"position_m": [0.1, 1.9]})
    robot.stretch_rad[:] = 0.12, 0.12, -0.12  # some 4 mm upward
    robot.until_rest()
    robot.run(1.0)
    assert robot.program.at_rest and not robot.program.progress()["done"]
    robot.stretch_rad[:] = 0.0
    robot.run(0.15)
    assert not robot.program.progress()["done"], "it has only just come"
    robot.run(0.15)
    told = robot.program.progress()
    assert (told["done"], told["trouble"]) == (1.0, "")


def test_a_platform_that_friction_keeps_away_is_waited_for_no_longer_than_5_s(
    robot: Ideal,
) -> None:
    robot.program.command({"position_m": [0.1, 1.9]})
    robot.stretch_rad[:] = 0.12, 0.12, -0.12
    robot.until_rest()
    robot.run(4.9)
    assert not robot.program.progress()["done"]
    robot.run(0.2)
    told = robot.program.progress()
    assert told["done"] == 1.0
    off_mm = 1e3 * float(np.linalg.norm(robot.control.estimated - [0.1, 1.9]))
    assert off_mm > 1.0
    assert told["trouble"] == f"the platform stands {off_mm:.1f} mm from its target"


def test_a_speed_may_be_asked_for(robot: Ideal) -> None:
    robot.program.command({"position_m": [0.1, 1.9], "speed_m_s": 0.05})
    robot.until_rest()
    assert np.abs(robot.paces).max() == pytest.approx(0.05)


def test_a_target_that_changes_in_motion_does_not_step(robot: Ideal) -> None:
    robot.program.command({"position_m": [0.5, 2.2]})
    robot.run(0.4)
    robot.program.command({"position_m": [-0.5, 1.5]})
    robot.until_rest()
    robot.check_motion()
    assert robot.control.position == pytest.approx([-0.5, 1.5])


@pytest.mark.parametrize(
    ("wanted", "told"),
    [
        ({"position_m": [0.7, 1.9]}, r"position_m\[0\].*-0.6 to 0.6 m, the workspace"),
        ({"position_m": [float("nan"), 1.9]}, r"position_m\[0\]"),
        ({"position_m": [0.0, 1.9, 0.0]}, "a list of 2"),
        ({"position_m": [0.0, 1.9], "stream": True}, "one of"),
        ({"stream": 1}, "stream: value 1; allowed: true"),
        ({"resume": True}, "no target has been left"),
        ({"position_m": [0.0, 1.9], "speed_m_s": 0.6}, "speed_m_s"),
        ({"velocity": 1}, "velocity"),
    ],
)
def test_what_is_not_possible_is_refused(
    robot: Ideal, wanted: dict[str, object], told: str
) -> None:
    with pytest.raises(ProgramError, match=told):
        robot.program.command(wanted)
    robot.run(0.05)
    assert robot.program.at_rest
    assert np.ptp(robot.path, axis=0).max() == 0.0


@pytest.fixture(scope="module")
def made_wide() -> Ideal:
    """A robot in whose box lies what no tensions hold."""
    assert ROBOT.platform is not None
    return Ideal(
        dataclasses.replace(ROBOT.platform, workspace_min_m=(-1.8, 0.7), workspace_max_m=(1.8, 2.9))
    )


@pytest.fixture
def wide(made_wide: Ideal) -> Ideal:
    made_wide.restart()
    return made_wide


def test_a_place_in_the_box_that_tensions_cannot_hold_is_refused_with_the_reason(
    wide: Ideal,
) -> None:
    with pytest.raises(ProgramError, match=r"cable \d would need .* N outside"):
        wide.program.command({"position_m": [1.7, 0.8]})
    wide.program.command({"stream": True})
    wide.run(0.05)
    hand = np.linspace([0.0, 0.0], [2.5, -1.5], 150)
    wide.lead(hand)
    wide.check_motion()
    assert "N outside" in wide.program.progress()["held_back"]
    assert wide.control.velocity == pytest.approx(np.zeros(2), abs=1e-6)
    assert all(wide.control.stands(place) for place in wide.path)
    wide.lead(hand[::-1])  # it does not stay caught there
    assert wide.control.position[0] < 0.5 * max(place[0] for place in wide.path)


def test_what_no_tensions_hold_is_not_entered_on_the_way_either_and_that_is_told(
    wide: Ideal,
) -> None:
    wide.program.command({"position_m": [0.5, 1.8]})
    wide.program._target[:] = 1.7, 0.8  # as if nobody had looked before
    assert wide.program._aim is not None
    wide.program._aim[:] = 1.7, 0.8
    wide.run(6.0)
    assert all(wide.control.stands(place) for place in wide.path)
    assert wide.control.velocity == pytest.approx(np.zeros(2), abs=1e-9)
    wide.check_motion()
    told = wide.program.progress()
    assert not told["done"] and "no way on, at " in told["trouble"]
    assert "N outside" in told["trouble"]
    wide.program.command({"position_m": [0.0, 1.8]})
    assert not wide.program.progress()["trouble"]
    wide.until_rest()


def on_the_border(robot: Ideal, angle: float) -> np.ndarray:
    """Return the outermost place that is held, in a direction from the middle of the box."""
    middle, way = np.array([0.0, 1.8]), np.array([math.cos(angle), math.sin(angle)])
    held, not_held = 0.0, 1.0
    for _ in range(25):
        share = 0.5 * (held + not_held)
        if robot.control.stands(middle + share * way):
            held = share
        else:
            not_held = share
    return np.asarray(middle + 0.998 * held * way)


@pytest.mark.parametrize(("begin", "end"), [(0.0, 200.0), (250.0, 350.0), (340.0, 190.0)])
def test_a_way_between_places_on_the_border_is_gone_to_its_end(
    wide: Ideal, begin: float, end: float
) -> None:
    wide.restart(on_the_border(wide, math.radians(begin)))
    target = on_the_border(wide, math.radians(end))
    wide.program.command({"position_m": target.tolist()})
    wide.until_rest()
    wide.check_motion()
    assert wide.control.position == pytest.approx(target, abs=1e-9)
    assert all(wide.control.stands(place) for place in wide.path)


def test_a_platform_let_down_where_no_tensions_hold_it_is_taken_out_of_there_again(
    wide: Ideal,
) -> None:
    wide.run(0.1)
    stand = np.array([0.0, 2.7])
    wide.restart(stand)
    assert not wide.control.stands(stand)
    wide.program.command({"position_m": [0.0, 1.8]})
    wide.until_rest()
    assert wide.control.position == pytest.approx([0.0, 1.8])


def test_a_new_target_in_motion_along_the_border_is_reached(wide: Ideal) -> None:
    begin, over, target = (on_the_border(wide, math.radians(at)) for at in (350.0, 250.0, 200.0))
    wide.restart(begin)
    wide.program.command({"position_m": over.tolist()})
    wide.run(1.2)
    wide.program.command({"position_m": target.tolist()})
    wide.until_rest()
    wide.check_motion()
    assert wide.control.position == pytest.approx(target, abs=1e-9)
    assert all(wide.control.stands(place) for place in wide.path)


def test_resume_goes_on_to_the_target_that_was_left(robot: Ideal) -> None:
    robot.program.command({"position_m": [0.5, 2.2]})
    robot.run(0.3)
    robot.program.stop()
    robot.until_rest()
    halted = robot.control.position.copy()
    assert np.abs(halted - [0.5, 2.2]).max() > 0.1
    robot.program.start(robot.feedback, robot.setpoint, robot.torque)
    assert robot.program.progress()["left_m"] == [0.5, 2.2]
    robot.program.command({"resume": True})
    robot.until_rest()
    assert robot.control.position == pytest.approx([0.5, 2.2])
    with pytest.raises(ProgramError, match="no target has been left"):
        robot.program.command({"resume": True})


def test_a_hand_leads_by_its_scale(robot: Ideal) -> None:
    robot.program.command({"stream": True})
    start = robot.path[0]
    robot.lead(np.linspace([0.3, 0.1], [0.34, 0.08], 50), scale=4.0)
    robot.lead(np.full((30, 2), (0.34, 0.08)), scale=4.0)
    robot.check_motion()
    assert robot.control.position - start == pytest.approx([0.16, -0.08], abs=2e-5)


def test_a_hand_lifts_a_platform_off_its_stand_before_it_leads_it_sideways(robot: Ideal) -> None:
    assert robot.platform is not None
    robot.restart(np.array(robot.platform.home_m))
    robot.program.command({"stream": True})
    start = robot.control.position.copy()
    robot.lead(np.outer(np.ones(20), (0.0, 0.0)))
    robot.lead(np.outer(np.linspace(0.0, 0.2, 40), (1.0, 0.1)))
    assert robot.control.position[0] == start[0]
    assert robot.control.position[1] == pytest.approx(start[1] + 0.02, abs=2e-3)
    assert "up first" in robot.program.progress()["held_back"]
    robot.lead(np.column_stack((np.full(40, 0.2), np.linspace(0.02, 0.2, 40))))
    robot.lead(np.column_stack((np.linspace(0.2, 0.4, 60), np.full(60, 0.2))))
    robot.lead(np.outer(np.ones(20), (0.4, 0.2)))
    assert robot.control.position[0] == pytest.approx(start[0] + 0.2, abs=5e-3)


def test_the_clutch_lets_the_hand_move_without_leading(robot: Ideal) -> None:
    robot.program.command({"stream": True})
    robot.lead(np.linspace([0.0, 0.0], [0.1, 0.0], 30))
    robot.lead(np.linspace([0.1, 0.0], [0.1, 0.0], 30), buttons=CLUTCH)
    held = robot.control.position.copy()
    robot.lead(np.linspace([0.1, 0.0], [-0.2, 0.1], 60), buttons=CLUTCH)
    assert robot.control.position == pytest.approx(held, abs=1e-7)
    robot.lead(np.full((30, 2), (-0.2, 0.1)))
    assert robot.control.position == pytest.approx(held, abs=1e-7), "nor does its release step"
    robot.check_motion()


def test_the_platform_does_not_run_on_after_a_quick_hand_has_stopped(robot: Ideal) -> None:
    robot.program.command({"stream": True})
    robot.lead(np.linspace([0.0, 0.0], [0.5, 0.0], 10))
    stopped = robot.control.position[0]
    robot.lead(np.full((60, 2), (0.5, 0.0)))
    robot.check_motion()
    assert robot.control.position[0] - stopped < SPEED_m_s * (0.3 + 0.5 * 0.25) + 0.02
    assert robot.control.velocity == pytest.approx(np.zeros(2), abs=1e-6)


def test_trembling_at_rest_does_not_move_the_platform(robot: Ideal) -> None:
    robot.program.command({"stream": True})
    chance = np.random.default_rng(3)
    robot.lead(np.zeros((5, 2)))
    robot.lead(chance.uniform(-1e-5, 1e-5, (200, 2)))
    assert np.ptp(np.array(robot.path)[200:], axis=0).max() < 1e-5


steps = st.tuples(
    st.floats(-2.0, 2.0, width=32) | st.just(float("nan")),
    st.floats(-2.0, 2.0, width=32) | st.just(float("inf")),
    st.sampled_from((0.5, 1.0, 8.0)),
    st.sampled_from((0, 0, 0, CLUTCH)),
    st.integers(1, 120),
)


@settings(derandomize=True, deadline=None, max_examples=25)
@given(st.lists(steps, min_size=5, max_size=25))
def test_nothing_that_a_stream_brings_makes_a_step(
    made: Ideal, hand: list[tuple[float, float, float, int, int]]
) -> None:
    made.restart()
    made.program.command({"stream": True})
    for x, y, scale, buttons, cycles in hand:
        made.post(x, y, scale, buttons)
        for _ in range(cycles):
            made.cycle()
    made.run(0.9)  # silence is borne for half a second
    made.check_motion()
    assert made.platform is not None
    path = np.array(made.path)
    assert (path >= np.array(made.platform.workspace_min_m) - 1e-9).all()
    assert (path <= np.array(made.platform.workspace_max_m) + 1e-9).all()
    assert np.isfinite(made.torque).all()
    assert made.control.velocity == pytest.approx(np.zeros(2), abs=1e-6), "silence ends motion"
