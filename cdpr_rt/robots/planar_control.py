"""Control of a planar robot with three cables: where it is, and the torques that move it.

Tremblay (thesis), section 2.4, with the velocity loop of each motor replaced by one of the
platform, in two directions: what it asks for is a force that the tensions exert within their
bounds, so that no cable is unwound and the motors never pull against each other.
"""

from __future__ import annotations

import math

import numpy as np

from cdpr_rt.controllers.pid import Compensation
from cdpr_rt.exchange import AxisFeedback, FloatArray, Setpoint
from cdpr_rt.robots import planar_kernel as kernel
from cdpr_rt.robots.planar_kinematics import GeometryError
from cdpr_rt.robots.planar_tensions import (
    PlanarTensions,
    TensionOutcome,
    carry,
    first_obstacle,
    stand,
)
from profiles import RobotAxis
from profiles.platform import Platform

RESERVE = 0.12
"""Share of the span of tensions that is left to what no plan knows: loops, friction, swinging."""
_OBSERVER_Hz = 400.0
_SMOOTHER_Hz = 25.0
_DAMPING_RATIO = 0.55
_ROTOR_SHARE = 0.75
_SMOOTH_SHARE = 0.55
_LOAD_SHARE = 0.28
_INTEGRAL_RATE = 5.0
_INTEGRAL_PHASE = 0.15
_INTEGRAL_SHARE = 0.3
_REGULATOR_SHARE = 0.25
_LOOSE_SHARE = 0.1
_DEAD_m = 6e-5
_BREAKING = 6.0
_STUCK_m_s = 0.002
_SETTLING_STEPS = 60
_ITERATIONS = 3
_LIFT_S = 0.05
_SHAPING_S = 0.06
_LATENCY_s, _LATENCY_CYCLES = 0.8e-3, 1.5


class PlanarControl:
    """A controller whose set-point is a platform's: position, velocity, acceleration, (2,) each.

    As a `Controller` it writes the axes' set-points itself, so that others may go on from there.
    `low_N` and `high_N` (3,) are the tensions' bounds, `torque_Nm` (3,) what the motors may be
    asked for. Raises GeometryError for a robot that is not planar or has not three cables.
    """

    def __init__(
        self,
        platform: Platform,
        axes: list[RobotAxis],
        low_N: FloatArray,
        high_N: FloatArray,
        torque_Nm: FloatArray,
        period_s: float,
        compensation: Compensation | None = None,
    ) -> None:
        if not platform.is_planar or len(axes) != 3:
            raise GeometryError(f"{len(axes)} axes; allowed: 3 in a plane")
        span = np.asarray(high_N, float) - low_N
        self._reserve_N = float(RESERVE * span.min())
        self.tensions = PlanarTensions(low_N + self._reserve_N, high_N - self._reserve_N)
        self.least_N = np.array(low_N, float)
        self.torque_Nm = np.array(torque_Nm, float)
        self.position_m = np.array(platform.home_m, float)
        self.velocity_m_s = np.zeros(2)
        self.acceleration_m_s2 = np.zeros(2)
        self._past = np.zeros((max(1, round(_SHAPING_S / period_s)), 3, 2))
        self._shaped = np.zeros((3, 2))
        self._place = 0
        self.shaped_m: FloatArray = self._shaped[0]
        """The set-point's position as the control follows it: shaped, some cycles later, (2,)."""
        self._shape_anew()
        self.tension_N = np.array(self.tensions.low)
        self.outcome, self.outside_N, self.share = 0, 0.0, 1.0
        self.effort_Nm, self.compensation_Nm = np.zeros(3), np.zeros(3)
        self._lift, self._pace = 0.0, period_s / (period_s + _LIFT_S)
        self._compensation = compensation
        self._robot = self._robot_row(platform, axes, float(span.min()), period_s)
        self._state = np.zeros(1, kernel.STATE)
        self._cables = self._cable_rows(platform, axes, torque_Nm)
        self._J, self._room = np.zeros((3, 2)), np.zeros((4, 3))
        self._wrench, self._force = np.zeros(2), np.zeros(2)
        self._carried, self._inner = np.array(self.tensions.low), np.zeros(3)
        self._wrenches = _wrenches(platform)
        self._there, self._tried_N = np.zeros(2), np.zeros(3)
        self.feasible_way(self.position_m)  # compiled here, not when somebody asks
        self._home = np.array(platform.home_m, float)
        self._pose = np.zeros(7)

    @staticmethod
    def _robot_row(
        platform: Platform, axes: list[RobotAxis], span_N: float, period_s: float
    ) -> np.ndarray[tuple[int], np.dtype[np.void]]:
        row = np.zeros(1, kernel.ROBOT)
        inertia = max(axis.winch.motor.rotor_inertia_kg_m2 for axis in axes)
        rotors_kg = [
            axis.winch.motor.rotor_inertia_kg_m2 / axis.winch.cable_m_per_motor_rad**2
            for axis in axes
        ]
        # the lightest is what quick damping sets swinging first
        rotor_kg = min(rotors_kg)
        mass = platform.mass_kg + 0.5 * sum(rotors_kg)
        observer = 2.0 * math.pi * _OBSERVER_Hz
        late_s = _LATENCY_s + _LATENCY_CYCLES * period_s + 2.0 / observer
        quick = _ROTOR_SHARE * rotor_kg / late_s
        damping = min(quick / (1.0 - _SMOOTH_SHARE), _LOAD_SHARE * mass / late_s)
        row["mass"], row["period"], row["inertia"] = platform.mass_kg, period_s, inertia
        row["observer"], row["damping"] = observer, damping
        row["smoother"], row["smooth"] = 2.0 * math.pi * _SMOOTHER_Hz, _SMOOTH_SHARE
        row["stiffness"] = mass * (damping / (2.0 * _DAMPING_RATIO * mass)) ** 2
        row["integral"] = min(_INTEGRAL_RATE, _INTEGRAL_PHASE * damping / mass) * row["stiffness"]
        row["loose"] = _LOOSE_SHARE * damping
        row["most_N"] = _INTEGRAL_SHARE * span_N
        row["breaking"], row["stuck_m_s"] = _BREAKING, _STUCK_m_s
        row["dead_m"], row["regulator_N"] = _DEAD_m, _REGULATOR_SHARE * span_N
        return row

    @staticmethod
    def _cable_rows(
        platform: Platform, axes: list[RobotAxis], torque_Nm: FloatArray
    ) -> np.ndarray[tuple[int], np.dtype[np.void]]:
        rows = np.zeros(len(axes), kernel.CABLE)
        rows["exit"], rows["anchor"] = platform.exit_points_m, platform.anchor_points_m
        rows["rigidity"] = [axis.winch.cable.stiffness_N for axis in axes]
        rows["m_per_rad"] = [axis.winch.cable_m_per_motor_rad for axis in axes]
        rows["torque"] = torque_Nm
        return rows

    # -- Controller

    def reset(self) -> None:
        """Forget what was integrated."""
        self._state["integral"] = 0.0
        self._state["awake"] = 1.0
        self._lift, self.share = 0.0, 1.0
        if self._compensation is not None:
            self._compensation.reset()

    def update(self, feedback: AxisFeedback, setpoint: Setpoint, torque_Nm: FloatArray) -> None:
        """Write torques and the axes' set-points for the platform's present set-point."""
        self.observe(feedback)
        robot, state, cables = self._robot, self._state, self._cables
        motion = self.shaped_m, self._shaped[1], self._shaped[2]
        self._place = kernel.shape(
            self._past,
            self._place,
            self.position_m,
            self.velocity_m_s,
            self.acceleration_m_s2,
            self._shaped,
        )
        kernel.refer(
            cables,
            *motion,
            setpoint.position_rad,
            setpoint.velocity_rad_s,
            setpoint.acceleration_rad_s2,
        )
        if self._compensation is not None:
            self._compensation.torque(feedback, setpoint, self.compensation_Nm)
        kernel.correct(robot, state, *motion, self.share, self._wrench, self._force)
        np.negative(cables["way"], out=self._J)
        self.outcome, self.outside_N, self.share, self._lift = carry(
            self._J,
            self._wrench,
            self._force,
            self.tensions.low,
            self.tensions.high,
            self._reserve_N,
            self._pace,
            self._lift,
            self.tension_N,
            self._carried,
            self._inner,
            self._room,
        )
        kernel.drive(
            robot,
            cables,
            self.tension_N,
            self._carried,
            self._inner,
            setpoint.acceleration_rad_s2,
            self.compensation_Nm,
            self.effort_Nm,
            torque_Nm,
        )

    # -- where the platform is

    def begin(self, feedback: AxisFeedback) -> None:
        """Take the motors to stand where they are, and the platform where its cables have it."""
        self._cables["theta"] = feedback.position_rad
        for field in ("omega", "lagging", "calm"):
            self._cables[field] = 0.0
        self._cables["tension"] = np.maximum(self._cables["tension"], self.tensions.low)
        self._state["position"][0] = self._home
        for _ in range(_SETTLING_STEPS):
            self.observe(feedback)

    def stand_still(self) -> None:
        """Have the set-point stand where the platform is."""
        self.position_m[:] = self.estimated_m
        self.velocity_m_s[:] = self.acceleration_m_s2[:] = 0.0
        self._shape_anew()

    def _shape_anew(self) -> None:
        self._past[:] = self._shaped[:] = 0.0
        self._past[:, 0] = self._shaped[0] = self.position_m

    def observe(self, feedback: AxisFeedback) -> None:
        """Bring the estimate of the platform's position up to date, by one cycle."""
        kernel.estimate(self._robot, self._state, self._cables, feedback.position_rad, _ITERATIONS)

    def lengths_at_home(self, tension_N: FloatArray) -> FloatArray:
        """Return the cables' lengths (3,) without tension, of a platform that stands upright at
        home, its cables under `tension_N` (3,)."""
        cables = self._cables
        rho = np.linalg.norm(self._home + cables["anchor"] - cables["exit"], axis=1)
        return np.asarray(rho / (1.0 + tension_N / cables["rigidity"]))

    def take_lengths(self, length_m: FloatArray, feedback: AxisFeedback) -> None:
        """Take the cables to have these lengths without tension at the motors' angles, (3,).

        Those that are not a number, since this very cycle has set them, stay.
        """
        cables = self._cables
        at_zero = length_m - cables["m_per_rad"] * feedback.position_rad
        cables["length_at_zero"] = np.where(np.isfinite(at_zero), at_zero, cables["length_at_zero"])

    @property
    def settings(self) -> dict[str, float]:
        """What a cycle goes by besides the geometry, by name: `planar_kernel.ROBOT`, and more."""
        row = self._robot[0]
        told = {name: float(row[name]) for name in kernel.ROBOT.names or ()}
        return {**told, "reserve_N": self._reserve_N, "pace": self._pace}

    @property
    def shaping_cycles(self) -> int:
        """Over how many cycles the set-point is averaged."""
        return len(self._past)

    @property
    def angle_rad(self) -> float:
        """By how much the platform is turned."""
        return float(self._state["angle"][0])

    @property
    def stretching_N(self) -> FloatArray:
        """Tensions with which the cables are taken to be stretched, (3,), a view."""
        return np.asarray(self._cables["tension"])

    @property
    def free_lengths_at_zero_m(self) -> FloatArray:
        """Lengths of the cables without tension at the motors' zeros, (3,), a view."""
        return np.asarray(self._cables["length_at_zero"])

    @property
    def inertia_kg_m2(self) -> float:
        """Of each motor."""
        return float(self._robot["inertia"][0])

    @property
    def free_lengths_m(self) -> FloatArray:
        """Lengths of the cables without tension, as the motors' angles have them, (3,)."""
        c = self._cables
        return np.asarray(c["length_at_zero"] + c["m_per_rad"] * c["theta"])

    @property
    def estimated_m(self) -> FloatArray:
        """Where the platform's origin is, (2,), a view."""
        return np.asarray(self._state["position"][0])

    @property
    def residual_m(self) -> float:
        """How far the cables' lengths are from agreeing with each other, root mean square."""
        return float(self._state["residual"][0])

    @property
    def pose(self) -> FloatArray:
        """Where the platform is, (7,): x y z, quaternion w x y z; overwritten."""
        state, pose = self._state[0], self._pose
        pose[0], pose[1] = state["position"][0], state["position"][1]
        half = 0.5 * state["angle"]
        pose[3], pose[6] = math.cos(half), math.sin(half)
        return pose

    def missing(self) -> str:
        """Return why the last cycle's tensions are not feasible, an empty text where they are."""
        return self.tensions.missing(self.outcome, self.outside_N, self.tension_N)

    def stands(self, position_m: FloatArray) -> bool:
        """Return whether the platform can be held, and accelerated, at a position (2,)."""
        return self._stand(position_m)[0] == TensionOutcome.FEASIBLE

    def feasible(self, position_m: FloatArray) -> str:
        """Return why the platform cannot stand at a position (2,), an empty text where it can.

        Tensions keep a reserve to their bounds there while it is accelerated in any direction.
        """
        return self._told(*self._stand(position_m))

    def feasible_way(self, position_m: FloatArray) -> str:
        """Return what is in the straight way to a position (2,), an empty text for nothing."""
        outcome, outside_N = first_obstacle(
            self.position_m, position_m, self._cables["exit"], self._cables["anchor"],
            self._wrenches, self.tensions.low, self.tensions.high,
            self._there, self._J, self._tried_N, self._room,
        )  # fmt: skip
        why = self._told(outcome, outside_N)
        return f"at {self._there[0]:.3f}, {self._there[1]:.3f} m {why}" if why else ""

    def _stand(self, position_m: FloatArray) -> tuple[int, float]:
        return stand(
            position_m, self._cables["exit"], self._cables["anchor"],
            self._wrenches, self.tensions.low, self.tensions.high,
            self._J, self._tried_N, self._room,
        )  # fmt: skip

    def _told(self, outcome: int, outside_N: float) -> str:
        why = self.tensions.missing(outcome, outside_N, self._tried_N)
        return f"{why} (with a reserve of {self._reserve_N:.1f} N)" if why else ""


def _wrenches(platform: Platform) -> FloatArray:
    """Return what acts on a platform that stands, or is accelerated as much as it may, (5, 2)."""
    most = platform.mass_kg * platform.acceleration_m_s2
    weight = np.array([0.0, -platform.mass_kg * kernel.G_m_s2])
    ways = np.array([(0.0, 0.0), (1.0, 1.0), (1.0, -1.0), (-1.0, 1.0), (-1.0, -1.0)])
    return np.asarray(weight + most * ways)
