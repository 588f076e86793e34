"""Bare motors of the whole series, loaded and blocked axes, with the position loop of `jog`."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from cdpr_profiles import ProfileError, Winch, load_winch
from cdpr_profiles.catalogue import list_profiles, load_motor
from cdpr_profiles.motor_bounds import MotorBounds
from cdpr_rt.arrays import FloatArray
from cdpr_rt.control.compensation import Compensation
from cdpr_rt.control.pid import Pid
from cdpr_rt.control.tuning import analyse
from cdpr_rt.core.exchange import AxisFeedback, Setpoint
from cdpr_rt.motion.trajectory import TrapezoidalMove
from cdpr_rt.programs.model import position_loop
from cdpr_sim_bus.robot import servo
from cdpr_sim_bus.robot.motor_state import MotorRatings
from cdpr_sim_bus.robot.plant import LoadPlant, Plant
from tests.sim_bus.robot.bare_motor import Motor
from tests.tools.motor_profiles import profile_of

WINCH, PERIOD_S, RAMP_S = "winch-mpp0923d", 1e-3, 0.5
SETTLED_deg, SETTLED_S = 1.0, 1.0


def series() -> list[str]:
    """Return one name for each rotor of the MPP and MPJ series with a complete data sheet."""
    found: dict[tuple[float, float], str] = {}
    for name in list_profiles()["motors"]:
        try:
            motor = load_motor(name)
        except ProfileError:
            continue
        found.setdefault((motor.rotor_inertia_kg_m2, motor.rated_torque_Nm), name)
    return sorted(found.values())


class MotorUnderLoop:
    """A simulated motor with the position loop of a bare rotor."""

    def __init__(self, winch: Winch, plant: Plant, compensated: bool = False) -> None:
        motor, self.plant = winch.motor, plant.of(winch)
        self._rated_Nm = motor.rated_torque_Nm
        ratings = {name: getattr(motor, name) for name in MotorRatings.__annotations__}
        self._motor = Motor(self.plant, MotorRatings(**ratings))
        self._count_rad = math.tau / self.plant.encoder.counts_per_turn
        self._feedback, self._setpoint = AxisFeedback(1), Setpoint(1)
        self._torque, self._permille = np.zeros(1), 0.0
        self._step()
        known = None
        if compensated:
            stored = profile_of(winch, self.plant, 1).harmonic
            known = Compensation([stored.compensation(MotorBounds(motor))], PERIOD_S)
            self._feedback.index_rad[0] = math.radians(self.plant.encoder.index_deg) + self._offset
            self._feedback.index_known[0] = True
        design = position_loop(motor.rotor_inertia_kg_m2, winch.latency_s, PERIOD_S)
        most_Nm = np.array([0.25 * self._rated_Nm])
        self._pid = Pid([design.gains], most_Nm, PERIOD_S, known)

    def _step(self) -> None:
        sample = self._motor.step(PERIOD_S, servo.TORQUE, self._permille)
        self._feedback.position_rad[0] = sample.counts * self._count_rad
        self._offset = sample.counts * self._count_rad - sample.angle_rad

    def jog(self, speed_deg_s: float, seconds: float, settle_s: float) -> FloatArray:
        """Return the error in degrees in each cycle after the motion."""
        speed_rad_s = np.array([math.radians(speed_deg_s)])
        start_rad = self._feedback.position_rad
        leg = TrapezoidalMove(start_rad, speed_rad_s, seconds - RAMP_S, RAMP_S, settle_s)
        errors = []
        for cycle in range(round(leg.duration_s / PERIOD_S)):
            leg.fill(cycle * PERIOD_S, self._setpoint)
            self._pid.update(self._feedback, self._setpoint, self._torque)
            self._step()
            # a commanded torque acts one cycle later
            self._permille = float(round(1e3 * self._torque[0] / self._rated_Nm))
            errors.append(math.degrees(self._feedback.position_rad[0] - leg.end_rad()[0]))
        return np.array(errors[round((seconds + RAMP_S) / PERIOD_S) :])


@pytest.mark.parametrize("compensated", [False, True])
@pytest.mark.parametrize("name", series())
def test_each_motor_turns_by_the_commanded_angle_and_stands(name: str, compensated: bool) -> None:
    winch = replace(load_winch(WINCH), motor=load_motor(name))
    motor = MotorUnderLoop(winch, Plant(), compensated)
    for speed_deg_s, seconds in ((20.0, 3.0), (90.0, 3.0), (-20.0, 3.0), (360.0, 2.0)):
        after = motor.jog(speed_deg_s, seconds, 3.0 * SETTLED_S)
        settled = after[round(SETTLED_S / PERIOD_S) :]
        assert np.abs(settled).max() < SETTLED_deg, (speed_deg_s, settled[:: settled.size // 5])


def test_a_load_of_fifty_rotors_comes_to_rest() -> None:
    winch = load_winch(WINCH)
    inertia = 50.0 * winch.motor.rotor_inertia_kg_m2
    motor = MotorUnderLoop(winch, Plant(load=LoadPlant(inertia_kg_m2=inertia)))
    for speed_deg_s in (20.0, 90.0, -20.0):
        after = motor.jog(speed_deg_s, 3.0, 4.0)
        assert np.abs(after).max() < 10.0
        assert np.abs(after[-1000:]).max() < 2.0


@pytest.mark.parametrize("counts", [0, 1])
def test_a_blocked_axis_is_not_pulled_harder_by_the_following_part(counts: int) -> None:
    """The axis is blocked, with encoder noise of `counts`, while the set-point moves and stops."""
    winch, seed = load_winch(WINCH), 4
    print("seed", seed)
    design = position_loop(winch.motor.rotor_inertia_kg_m2, winch.latency_s, PERIOD_S)
    usual = replace(design.gains, following_Nm_rad_s=0.0)
    feedback, setpoint, torque_Nm = AxisFeedback(2), Setpoint(2), np.zeros(2)
    pid = Pid([design.gains, usual], np.full(2, 10.0), PERIOD_S)
    leg = TrapezoidalMove(np.zeros(2), np.full(2, math.radians(20.0)), 1.5, RAMP_S, 5.0)
    read = np.random.default_rng(seed).integers(0, counts + 1, round(leg.duration_s / PERIOD_S))
    for cycle, count in enumerate(read):
        leg.fill(cycle * PERIOD_S, setpoint)
        feedback.position_rad[:] = count * math.tau / 8192
        pid.update(feedback, setpoint, torque_Nm)
    assert torque_Nm[1] > 0.5  # torque of the proportional part and the usual integral
    assert torque_Nm[0] - torque_Nm[1] == pytest.approx(0.0, abs=0.05 if counts else 1e-12)


def test_a_loop_with_following_part_keeps_its_margins() -> None:
    winch = load_winch(WINCH)
    for period_s in (0.5e-3, 1e-3, 2e-3, 4e-3):
        latency_s = winch.latency_s + 1.5 * (period_s - PERIOD_S)
        design = position_loop(winch.motor.rotor_inertia_kg_m2, latency_s, period_s)
        whole = design.gains.integral_Nm_rad_s + design.gains.following_Nm_rad_s
        gains = replace(design.gains, integral_Nm_rad_s=whole)
        follows = analyse(gains, design.inertia_kg_m2, design.latency_s, period_s)
        assert follows.sensitivity_peak < 2.5
        assert follows.gain_margin_dB > 6.0
