"""Bare motors of the whole series, turned by the position loop on the simulator's physics."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from cdpr_profiles import ProfileError, Winch, load_winch
from cdpr_profiles.catalogue import list_profiles, load_motor
from cdpr_profiles.limits.motor_bounds import MotorBounds
from cdpr_rt.control.compensation import Compensation
from cdpr_rt.control.pid import Pid
from cdpr_rt.control.stiction import most_push_Nm
from cdpr_rt.core.exchange import AxisFeedback, FloatArray, Setpoint
from cdpr_rt.motion.trajectory import Leg
from cdpr_rt.programs.model import position_loop
from cdpr_sim_bus.robot import servo
from cdpr_sim_bus.robot.motor import Motor
from cdpr_sim_bus.robot.motor_state import MotorRatings
from cdpr_sim_bus.robot.plant import FrictionPlant, Plant
from tests.tools.motor_profiles import profile_of

PERIOD_S = 1e-3
SETTLED_deg, SETTLED_S = 1.0, 1.0


def series() -> list[str]:
    """Return one name for each rotor of the MPP and MPJ series whose winding is known."""
    found = {}
    for name in list_profiles()["motors"]:
        try:
            motor = load_motor(name)
        except ProfileError:  # the data sheet tells its ratings only
            continue
        found.setdefault((motor.rotor_inertia_kg_m2, motor.rated_torque_Nm), name)
    return sorted(found.values())


class BareMotor:
    """A motor without load under the loop of `cdpr drive jog` and of the daemon's axes."""

    def __init__(
        self, winch: Winch, plant: Plant, compensated: bool = False, limit: float = 0.25
    ) -> None:
        motor, self.plant = winch.motor, plant.of(winch)
        self._rated_Nm = motor.rated_torque_Nm
        ratings = {name: getattr(motor, name) for name in MotorRatings.__annotations__}
        self._motor = Motor(self.plant, MotorRatings(**ratings))
        self._count_rad = math.tau / self.plant.encoder.counts_per_turn
        self._feedback, self._setpoint = AxisFeedback(1), Setpoint(1)
        self._torque, self._permille = np.zeros(1), 0.0
        self._step()
        known, axis = None, None
        if compensated:
            axis = profile_of(winch, self.plant, 1).better.compensation(MotorBounds(motor))
            known = Compensation([axis], PERIOD_S)
            self._feedback.index_rad[0] = math.radians(self.plant.encoder.index_deg) + self._offset
            self._feedback.index_known[0] = True
        design = position_loop(motor.rotor_inertia_kg_m2, winch.latency_s, PERIOD_S)
        most = np.array([limit * self._rated_Nm])
        push = np.array([most_push_Nm(self._rated_Nm, axis)])
        self._pid = Pid([design.gains], most, PERIOD_S, known, push)

    def _step(self) -> None:
        sample = self._motor.step(PERIOD_S, servo.TORQUE, self._permille)
        self._feedback.position_rad[0] = sample.counts * self._count_rad
        self._offset = sample.counts * self._count_rad - sample.angle_rad

    def jog(self, speed_deg_s: float, seconds: float, settle_s: float) -> FloatArray:
        """Return the error in degrees in each cycle after the motion."""
        start = self._feedback.position_rad.copy()
        ramp_s = min(0.5, 0.5 * seconds)
        speed = np.array([math.radians(speed_deg_s)])
        leg = Leg(start, speed, seconds - ramp_s, ramp_s, settle_s)
        asked = start[0] + speed[0] * seconds
        errors = []
        for cycle in range(round(leg.duration_s / PERIOD_S)):
            leg.fill(cycle * PERIOD_S, self._setpoint)
            self._pid.update(self._feedback, self._setpoint, self._torque)
            self._step()
            # what is asked for acts one cycle later
            self._permille = float(round(1e3 * self._torque[0] / self._rated_Nm))
            errors.append(math.degrees(self._feedback.position_rad[0] - asked))
        return np.array(errors[round((seconds + ramp_s) / PERIOD_S) :])

    def hold(self, off_deg: float, seconds: float) -> float:
        """Hold the rotor off where it rests; return the last torque asked for, Nm."""
        held = self._motor.record["angle"][0] + math.radians(off_deg)
        self._regulate(seconds, held)
        return float(self._torque[0])

    def let_go(self, seconds: float) -> FloatArray:
        """Return the angle off the set-point, deg, in each cycle from then on."""
        return np.degrees(self._regulate(seconds, None))

    def _regulate(self, seconds: float, held: float | None) -> FloatArray:
        errors = []
        self._setpoint.velocity_rad_s[:] = self._setpoint.acceleration_rad_s2[:] = 0.0
        for _ in range(round(seconds / PERIOD_S)):
            self._pid.update(self._feedback, self._setpoint, self._torque)
            if held is not None:
                self._motor.record["angle"], self._motor.record["velocity"] = held, 0.0
            self._step()
            self._permille = float(round(1e3 * self._torque[0] / self._rated_Nm))
            errors.append(self._feedback.position_rad[0] - self._setpoint.position_rad[0])
        return np.array(errors)


@pytest.mark.parametrize("compensated", [False, True])
@pytest.mark.parametrize("name", series())
def test_every_motor_turns_by_what_is_asked_and_stands(name: str, compensated: bool) -> None:
    winch = replace(load_winch("winch-mpp0923d"), motor=load_motor(name))
    motor = BareMotor(winch, Plant(), compensated)
    for speed_deg_s, seconds in ((20.0, 1.5), (-90.0, 1.0), (3.0, 1.0)):
        after = motor.jog(speed_deg_s, seconds, 1.5 * SETTLED_S)
        settled = after[round(SETTLED_S / PERIOD_S) :]
        assert np.abs(settled).max() < SETTLED_deg, (speed_deg_s, np.abs(settled).max())
        assert np.ptp(settled) < 0.5  # it does not hunt


@pytest.mark.parametrize(("coulomb_Nm", "breakaway_Nm"), [(0.01, 0.012), (0.12, 0.18)])
def test_motors_with_other_friction_settle_too(coulomb_Nm: float, breakaway_Nm: float) -> None:
    friction = FrictionPlant(coulomb_Nm=coulomb_Nm, breakaway_Nm=breakaway_Nm)
    motor = BareMotor(load_winch("winch-mpp0923d"), Plant(friction=friction))
    for speed_deg_s in (20.0, -90.0):
        settled = motor.jog(speed_deg_s, 1.5, 1.5 * SETTLED_S)[round(SETTLED_S / PERIOD_S) :]
        assert np.abs(settled).max() < SETTLED_deg


@pytest.mark.parametrize("compensated", [False, True])
@pytest.mark.parametrize("name", series())
def test_a_motor_that_was_held_fast_does_not_jump_when_let_go(name: str, compensated: bool) -> None:
    winch = replace(load_winch("winch-mpp0923d"), motor=load_motor(name))
    motor = BareMotor(winch, Plant(), compensated, limit=1.0)
    motor.jog(20.0, 1.0, SETTLED_S)
    held_Nm = [motor.hold(off_deg, 1.5) for off_deg in (1.0, 0.0)]
    rated_Nm = winch.motor.rated_torque_Nm
    assert abs(held_Nm[0]) < 0.2 * rated_Nm
    assert abs(held_Nm[1] - held_Nm[0]) < 0.05 * rated_Nm  # it is not wound up
    after_deg = motor.let_go(1.5 * SETTLED_S)
    over_10_ms = np.radians(after_deg[10:] - after_deg[:-10]) / (10 * PERIOD_S)
    assert np.abs(after_deg).max() < 5.0
    assert np.abs(over_10_ms).max() < 10.0
    assert np.abs(after_deg[round(SETTLED_S / PERIOD_S) :]).max() < SETTLED_deg
