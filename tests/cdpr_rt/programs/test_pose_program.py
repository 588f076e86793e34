"""A platform's set-point: straight lines, motion by a hand, and limits."""

from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest

from cdpr_profiles import load_robot
from cdpr_profiles.platform import Platform
from cdpr_rt.core.estimate import Estimator
from cdpr_rt.core.exchange import AxisFeedback, Setpoint
from cdpr_rt.core.shared_block import SAMPLE, SharedBlock
from cdpr_rt.model.platform_model import platform_model
from cdpr_rt.model.robot_arrays import winches_of
from cdpr_rt.motion.pose_stream import PoseStream
from cdpr_rt.platform.cable_control import CableControl
from cdpr_rt.programs.base import ProgramError
from cdpr_rt.programs.platform_program import PlatformParts
from cdpr_rt.programs.pose import PoseProgram
from tests.cdpr_rt.programs.ideal_platform import SteppedPlatform

PERIOD_S = 1e-3
ROBOT = load_robot("planar-3")
SPEED_m_s, ACCELERATION_m_s2 = 0.5, 2.0


class LedPlatform(SteppedPlatform):
    """A platform exactly at its set-point, and a hand whose packets arrive immediately."""

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
        """Start again, in the middle of the box or elsewhere."""
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
        self.control.setpoint.stand_at(middle)
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

    def post(self, x: float, y: float, scale: float = 1.0, buttons: int = 0) -> None:
        """Post the hand's position."""
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
        """Velocity and acceleration keep their bounds, also in the shaped motion."""
        paces = np.array(self.paces)
        assert np.abs(paces).max() <= SPEED_m_s * (1 + 1e-9)
        most = ACCELERATION_m_s2 * PERIOD_S
        assert np.abs(np.diff(paces, axis=0)).max() <= most * (1 + 1e-9) + 1e-12
        shaped = np.diff(np.array(self.shaped), axis=0) / PERIOD_S
        assert np.abs(shaped).max() <= SPEED_m_s * (1 + 1e-6)
        assert np.abs(np.diff(shaped, axis=0)).max() <= most * (1 + 1e-6)


@pytest.fixture(scope="module")
def made() -> LedPlatform:
    return LedPlatform()


@pytest.fixture
def robot(made: LedPlatform) -> LedPlatform:
    made.restart()
    return made


def test_a_motion_is_done_when_the_platform_arrives_not_its_set_point(robot: LedPlatform) -> None:
    robot.program.command({"position_m": [0.1, 1.9]})
    robot.stretch_rad[:] = 0.12, 0.12, -0.12  # some 4 mm upward
    robot.until_rest()
    robot.run(1.0)
    assert robot.program.at_rest and not robot.program.progress()["done"]
    robot.stretch_rad[:] = 0.0
    robot.run(0.15)
    assert not robot.program.progress()["done"], "it has arrived too recently"
    robot.run(0.15)
    told = robot.program.progress()
    assert (told["done"], told["trouble"]) == (1.0, "")


BAR = dataclasses.replace(
    ROBOT.platform,  # type: ignore[type-var]
    mass_kg=3.0,
    workspace_max_m=(0.5, 2.0),
    exit_points_m=((-2.0, 3.0), (2.0, 3.0), (0.1, 0.0)),
    anchor_points_m=((-0.15, 0.02), (0.25, 0.0), (0.03, -0.02)),
)


def test_a_platform_that_may_swing_is_reported_on_arrival() -> None:
    robot = LedPlatform(BAR)
    for position_m in ([0.4, 1.8], [-0.3, 1.5], [0.4, 1.5]):
        robot.program.command({"position_m": position_m})
        robot.until_rest()
        robot.run(0.3)
        told = robot.program.progress()
        if told["trouble"]:
            break
    assert told["done"] and "may still swing by" in told["trouble"]


def test_a_platform_kept_off_its_target_by_friction_is_awaited_for_5_s(robot: LedPlatform) -> None:
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


def test_a_target_that_changes_in_motion_does_not_step(robot: LedPlatform) -> None:
    robot.program.command({"position_m": [0.5, 2.2]})
    robot.run(0.4)
    robot.program.command({"position_m": [-0.5, 1.5]})
    robot.until_rest()
    robot.check_motion()
    assert robot.control.position == pytest.approx([-0.5, 1.5])


@pytest.mark.parametrize(
    ("wanted", "told"),
    [
        ({"position_m": [0.7, 1.9]}, "x 700 mm; allowed: -600 to 600 mm, the workspace"),
        ({"position_m": [float("nan"), 1.9]}, r"position_m\[0\]"),
        ({"position_m": [0.0, 1.9, 0.0]}, "a list of 2"),
        ({"position_m": [0.0, 1.9], "stream": True}, "one of"),
        ({"stream": 1}, "stream: value 1; allowed: true"),
        ({"resume": True}, "there is no target to continue"),
        ({"position_m": [0.0, 1.9], "speed_m_s": 0.6}, "speed_m_s"),
        ({"velocity": 1}, "velocity"),
    ],
)
def test_infeasible_targets_are_rejected(
    robot: LedPlatform, wanted: dict[str, object], told: str
) -> None:
    with pytest.raises(ProgramError, match=told):
        robot.program.command(wanted)
    robot.run(0.05)
    assert robot.program.at_rest
    assert np.ptp(robot.path, axis=0).max() == 0.0


@pytest.fixture(scope="module")
def made_wide() -> LedPlatform:
    """A robot with infeasible positions in its box."""
    assert ROBOT.platform is not None
    return LedPlatform(
        dataclasses.replace(ROBOT.platform, workspace_min_m=(-1.8, 0.7), workspace_max_m=(1.8, 2.9))
    )


@pytest.fixture
def wide(made_wide: LedPlatform) -> LedPlatform:
    made_wide.restart()
    return made_wide


def test_an_infeasible_position_in_the_box_is_rejected_with_the_reason(wide: LedPlatform) -> None:
    with pytest.raises(ProgramError, match=r"cable \d would need .* N outside"):
        wide.program.command({"position_m": [1.7, 0.8]})
    wide.program.command({"stream": True})
    wide.run(0.05)
    hand = np.linspace([0.0, 0.0], [2.5, -1.5], 150)
    wide.lead(hand)
    wide.check_motion()
    assert "N outside" in wide.program.progress()["held_back"]
    assert wide.control.velocity == pytest.approx(np.zeros(2), abs=1e-6)
    assert all(wide.control.is_feasible(place) for place in wide.path)
    wide.lead(hand[::-1])  # the hand can lead it back
    assert wide.control.position[0] < 0.5 * max(place[0] for place in wide.path)


def test_a_way_through_an_infeasible_region_stops_before_it_with_a_reason(
    wide: LedPlatform,
) -> None:
    wide.program.command({"position_m": [0.5, 1.8]})
    wide.program._target[:] = 1.7, 0.8  # as if nobody had checked the target
    assert wide.program._commanded is not None
    wide.program._commanded[:] = 1.7, 0.8
    wide.run(6.0)
    assert all(wide.control.is_feasible(place) for place in wide.path)
    assert wide.control.velocity == pytest.approx(np.zeros(2), abs=1e-9)
    wide.check_motion()
    told = wide.program.progress()
    assert not told["done"] and "the way is blocked, at " in told["trouble"]
    assert "N outside" in told["trouble"]
    wide.program.command({"position_m": [0.0, 1.8]})
    assert not wide.program.progress()["trouble"]
    wide.until_rest()


def on_the_border(robot: LedPlatform, angle: float) -> np.ndarray:
    """Return the outermost feasible place in a direction from the middle of the box."""
    middle, way = np.array([0.0, 1.8]), np.array([math.cos(angle), math.sin(angle)])
    held, not_held = 0.0, 1.0
    for _ in range(25):
        share = 0.5 * (held + not_held)
        if robot.control.is_feasible(middle + share * way):
            held = share
        else:
            not_held = share
    return np.asarray(middle + 0.998 * held * way)


@pytest.mark.parametrize(("begin", "end"), [(0.0, 200.0), (250.0, 350.0), (340.0, 190.0)])
def test_a_way_between_places_on_the_border_reaches_its_end(
    wide: LedPlatform, begin: float, end: float
) -> None:
    wide.restart(on_the_border(wide, math.radians(begin)))
    target = on_the_border(wide, math.radians(end))
    wide.program.command({"position_m": target.tolist()})
    wide.until_rest()
    wide.check_motion()
    assert wide.control.position == pytest.approx(target, abs=1e-9)
    assert all(wide.control.is_feasible(place) for place in wide.path)


def test_a_platform_can_leave_an_infeasible_position(wide: LedPlatform) -> None:
    wide.run(0.1)
    stand = np.array([0.0, 2.7])
    wide.restart(stand)
    assert not wide.control.is_feasible(stand)
    wide.program.command({"position_m": [0.0, 1.8]})
    wide.until_rest()
    assert wide.control.position == pytest.approx([0.0, 1.8])


def test_a_new_target_in_motion_along_the_border_is_reached(wide: LedPlatform) -> None:
    begin, over, target = (on_the_border(wide, math.radians(at)) for at in (350.0, 250.0, 200.0))
    wide.restart(begin)
    wide.program.command({"position_m": over.tolist()})
    wide.run(1.2)
    wide.program.command({"position_m": target.tolist()})
    wide.until_rest()
    wide.check_motion()
    assert wide.control.position == pytest.approx(target, abs=1e-9)
    assert all(wide.control.is_feasible(place) for place in wide.path)


def test_resume_keeps_the_requested_speed(robot: LedPlatform) -> None:
    def fastest_m_s() -> float:
        begin = len(robot.path)
        robot.until_rest()
        path = np.array(robot.path[begin:])
        return float(np.abs(np.diff(path, axis=0)).max()) / PERIOD_S

    robot.program.command({"position_m": [0.5, 2.2], "speed_m_s": 0.05})
    robot.run(0.3)
    robot.program.stop()
    robot.until_rest()
    robot.program.start(robot.feedback, robot.setpoint, robot.torque)
    robot.program.command({})
    robot.program.command({"resume": True})
    assert fastest_m_s() == pytest.approx(0.05, rel=0.02)
    robot.program.command({"position_m": [0.0, 2.0]})
    assert fastest_m_s() > 0.2


def test_a_hand_must_lift_a_platform_off_its_stand_before_moving_it_sideways(
    robot: LedPlatform,
) -> None:
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


def test_a_step_on_the_stand_is_rejected_with_the_way_into_the_workspace(
    robot: LedPlatform,
) -> None:
    assert robot.platform is not None
    home_m, low_m = robot.platform.home_m, robot.platform.workspace_min_m
    robot.restart(np.array(home_m))
    with pytest.raises(ProgramError) as refused:
        robot.program.check({"distance_m": [0.0, 0.02]})
    refusal = refused.value.args[0]
    enter_m = refusal.arguments["enter_m"]
    assert enter_m == [home_m[0], low_m[1]]
    robot.program.check({"position_m": enter_m})


def test_the_platform_stops_soon_after_a_quick_hand_has_stopped(robot: LedPlatform) -> None:
    robot.program.command({"stream": True})
    robot.lead(np.linspace([0.0, 0.0], [0.5, 0.0], 10))
    stopped = robot.control.position[0]
    robot.lead(np.full((60, 2), (0.5, 0.0)))
    robot.check_motion()
    assert robot.control.position[0] - stopped < SPEED_m_s * (0.3 + 0.5 * 0.25) + 0.02
    assert robot.control.velocity == pytest.approx(np.zeros(2), abs=1e-6)


def test_a_trembling_hand_does_not_move_the_platform(robot: LedPlatform) -> None:
    robot.program.command({"stream": True})
    chance = np.random.default_rng(3)
    robot.lead(np.zeros((5, 2)))
    robot.lead(chance.uniform(-1e-5, 1e-5, (200, 2)))
    assert np.ptp(np.array(robot.path)[200:], axis=0).max() < 1e-5
