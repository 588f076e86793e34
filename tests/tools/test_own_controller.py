"""A user's platform controller in simulation."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import cdpr_rt as cdpr


class PoseController(cdpr.Controller):
    """PID control of the pose. `failing` replaces the tensions from a given cycle on."""

    def __init__(self, failing: Callable[[np.ndarray], object] | None = None) -> None:
        self.failing, self.fails_at, self.cycles, self.resets = failing, 10**9, 0, 0
        self.integral = np.zeros(0)

    def reset(self, state: cdpr.State) -> None:
        self.integral = np.zeros_like(state.position)
        self.resets += 1

    def update(self, state: cdpr.State, target: cdpr.Target) -> np.ndarray:
        self.cycles += 1
        error = target.position - state.position
        self.integral += state.period_s * error
        force = 3000.0 * (error + 3.0 * self.integral)
        force += 250.0 * (target.velocity - state.velocity)
        tensions = state.distribute(force)
        if self.failing is not None and self.cycles >= self.fails_at:
            return self.failing(tensions)  # type: ignore[return-value]
        return tensions


class TorquePoseController(PoseController, cdpr.TorqueController):
    """The same as motor torques, each 20 mNm too small, as if it knew no friction."""

    def update(self, state: cdpr.State, target: cdpr.Target) -> np.ndarray:
        returned = super().update(state, target)
        if self.failing is not None and self.cycles >= self.fails_at:
            return returned
        self.torque_Nm = state.torques(returned) - 0.02
        return self.torque_Nm.copy()


@pytest.mark.parametrize("kind", [PoseController, TorquePoseController])
def test_a_numpy_controller_moves_the_platform(
    planar_file: Path, kind: type[PoseController]
) -> None:
    mine = kind()
    with cdpr.simulate(planar_file, controller=mine) as robot:
        robot.enable()
        assert mine.cycles == 0
        robot.tighten()
        assert mine.cycles == 0  # the platform is on its stand
        robot.move_to([0.2, 1.8])
        robot.wait(1.0)
        assert robot.position_m == pytest.approx([0.2, 1.8], abs=0.004)
        pose = robot.status["program"] == "pose"
        assert pose and mine.cycles > 250


def test_torques_are_commanded_as_returned_with_the_compensation_added(
    planar_file: Path,
) -> None:
    mine = TorquePoseController()
    with cdpr.simulate(planar_file, controller=mine) as robot:
        robot.enable()
        robot.tighten()
        robot.move_to([0.2, 1.6])
        robot.move_to([-0.2, 1.8], wait=False)
        for _ in range(5):
            robot.wait(0.2)
            row = robot.log("effort_Nm", "compensation_Nm", "torque_asked_Nm")[-1]
            assert row["effort_Nm"] == pytest.approx(mine.torque_Nm, abs=1e-9)
            sent_Nm = row["effort_Nm"] + row["compensation_Nm"]
            assert row["torque_asked_Nm"] == pytest.approx(sent_Nm, abs=1e-9)
            assert np.abs(row["compensation_Nm"]).max() > 0.01


def test_a_controller_in_cable_space_sees_lengths_that_agree_with_the_model(
    planar_file: Path,
) -> None:
    seen: list[float] = []
    model = cdpr.load(planar_file)

    class InCables(TorquePoseController):
        def update(self, state: cdpr.State, target: cdpr.Target) -> np.ndarray:
            if self.cycles % 20 == 19:
                J = model.jacobian(target.position)
                seen.extend(target.cable_length_m - model.lengths(target.position))
                seen.extend(target.cable_velocity_m_s - J @ target.velocity)
                seen.extend(state.cable_length_m - model.lengths(state.position))
                # rates that agree with no motion of the platform stretch the cables
                J = model.jacobian(state.position)
                seen.extend(J.T @ (state.cable_velocity_m_s - J @ state.velocity))
            return super().update(state, target)

    with cdpr.simulate(planar_file, controller=InCables()) as robot:
        robot.enable()
        robot.tighten()
        robot.move_to([0.2, 1.8])
    assert len(seen) > 100
    assert np.abs(seen).max() < 0.003  # m and m/s; the platform moves at 0.5 m/s


def infinite(tensions: np.ndarray) -> object:
    return tensions * np.nan


def leaving(_tensions: np.ndarray) -> object:
    raise SystemExit("enough")


def division(_tensions: np.ndarray) -> object:
    raise ZeroDivisionError("no way on")


def imaginary(tensions: np.ndarray) -> object:
    return tensions * 1j


def test_a_failing_controller_stops_the_robot_like_any_fault(planar_file: Path) -> None:
    mine = PoseController()
    with cdpr.simulate(planar_file, controller=mine) as robot:
        for failing, reason in (
            (infinite, r"PoseController.update returned \[nan nan nan\]; return 3 finite tensions"),
            (imaginary, r"j\s*\]; return 3 finite tensions in N"),
            (leaving, "SystemExit: enough"),
            (division, r"ZeroDivisionError: no way on \(test_own_controller.py:\d+\)"),
        ):
            mine.failing = None
            robot.enable()
            robot.tighten("home")
            mine.failing, mine.fails_at = failing, mine.cycles + 1000
            with pytest.raises(cdpr.Faulted, match=reason) as fault:
                robot.move_to([0.2, 1.8], speed_m_s=0.1)
            assert fault.value.limit == "not_finite" and robot.state == "fault"
            assert mine.cycles == mine.fails_at  # the built-in controller has lowered the platform
            home_m = robot.description["platform"]["home_m"]
            assert robot.true_pose[:2] == pytest.approx(home_m, abs=0.01)  # not where it failed
            robot.acknowledge()
        mine.failing = None
        robot.enable()
        robot.tighten("home")
        robot.move_to([0.2, 1.8])
        mine.failing, mine.fails_at = division, mine.cycles + 1
        with pytest.raises(cdpr.Faulted, match="no way on"):  # it has failed before the command
            robot.move_to([0.0, 1.8])
        assert robot.state == "fault"


def test_a_controller_that_commands_its_robot_is_rejected(planar_file: Path) -> None:
    class Commanding(PoseController):
        def update(self, state: cdpr.State, target: cdpr.Target) -> np.ndarray:
            robot.hold()
            return super().update(state, target)

    with cdpr.simulate(planar_file, controller=Commanding()) as robot:
        robot.enable()
        robot.tighten("home")
        with pytest.raises(cdpr.Faulted, match="a controller or program, uses this handle now"):
            robot.move_to([0.2, 1.8])


def test_wrong_torques_are_named_as_such(planar_file: Path) -> None:
    mine = TorquePoseController(lambda tensions: tensions[1:])
    mine.fails_at = 1
    with cdpr.simulate(planar_file, controller=mine) as robot:
        robot.enable()
        robot.tighten("home")
        with pytest.raises(
            cdpr.Faulted, match=r"update returned .*; return 3 finite motor torques"
        ):
            robot.move_to([0.2, 1.8])


def test_a_controller_whose_reset_ends_the_process_stops_the_robot(planar_file: Path) -> None:
    class Leaving(PoseController):
        def reset(self, state: cdpr.State) -> None:
            raise SystemExit("no start")

    with cdpr.simulate(planar_file, controller=Leaving()) as robot:
        robot.enable()
        with pytest.raises(cdpr.Faulted, match="SystemExit: no start"):
            robot.tighten("home")
            robot.move_to([0.2, 1.8])


def test_the_built_in_controller_brakes_and_lowers_after_any_fault(planar_file: Path) -> None:
    mine = PoseController()
    with cdpr.simulate(planar_file, controller=mine) as robot:
        robot.enable()
        robot.tighten()
        robot.move_to([0.0, 1.8])
        before = mine.cycles
        robot.inject_fault("lower", "drive-fault")
        for _ in range(300):  # the platform is lowered before power is cut
            with suppress(cdpr.Faulted):
                robot.wait(0.1)
            if robot.state == "fault":
                break
        assert robot.state == "fault"
        assert mine.cycles < before + 50


def test_the_state_of_a_controller_cannot_be_written(planar_file: Path) -> None:
    class Reaching(PoseController):
        def update(self, state: cdpr.State, target: cdpr.Target) -> np.ndarray:
            state.high_N[:] = 1e6
            return super().update(state, target)

    with cdpr.simulate(planar_file, controller=Reaching()) as robot:
        robot.enable()
        robot.tighten()
        with pytest.raises(cdpr.Faulted, match="read-only"):
            robot.move_to([0.0, 1.4])


@pytest.mark.parametrize("kind", [PoseController, TorquePoseController])
def test_tensions_are_limited_to_the_robots_bounds(
    planar_file: Path, kind: type[PoseController]
) -> None:
    seen: list[np.ndarray] = []

    class Pulling(kind):  # type: ignore[misc, valid-type]
        def update(self, state: cdpr.State, target: cdpr.Target) -> np.ndarray:
            seen.append(state.tension_N.copy())
            return np.asarray(super().update(state, target))

    mine = Pulling(lambda tensions: 1e4 * np.array([-1.0, 0.0, 1.0]))
    model = cdpr.load("planar-3")
    with cdpr.simulate(planar_file, controller=mine) as robot:
        robot.enable()
        robot.tighten()
        robot.move_to([0.0, 1.4])
        mine.fails_at = mine.cycles + 1
        robot.wait(0.02)
    low_N, high_N = seen[-1].min(), seen[-1].max()
    assert low_N == model.low_N.min()
    assert model.high_N.max() <= high_N < 2.0 * model.high_N.max()


@pytest.mark.parametrize("force", [3.0, [1.0, np.nan], [1.0, 2.0, 3.0], [1j, 2.0]])
def test_distribute_rejects_anything_but_a_finite_force(planar_file: Path, force: Any) -> None:
    class Scalar(PoseController):
        def update(self, state: cdpr.State, target: cdpr.Target) -> np.ndarray:
            return state.distribute(force)

    with cdpr.simulate(planar_file, controller=Scalar()) as robot:
        robot.enable()
        robot.tighten()
        with pytest.raises(cdpr.Faulted, match=r"distribute: force .*; give 2 finite numbers"):
            robot.move_to([0.0, 1.4])


def test_a_robot_without_a_platform_rejects_a_controller() -> None:
    with pytest.raises(cdpr.InvalidArgument, match="controller: bench-2 has no platform"):
        cdpr.simulate("bench-2", controller=PoseController())


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"controller": PoseController}, "controller: .*give an object of a class derived from"),
        ({"controller": "mine.py:Mine"}, "controller: 'mine.py:Mine'; give an object"),
        ({"programs": cdpr.Program}, "programs: .*give a list"),
        ({"plant": "missing.toml"}, "plant: missing.toml: no such file"),
    ],
)
def test_an_argument_of_the_wrong_kind_is_rejected_by_name(
    given: dict[str, Any], message: str
) -> None:
    with pytest.raises(cdpr.InvalidArgument, match=message):
        cdpr.simulate("planar-3", **given)
