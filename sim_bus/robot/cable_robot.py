"""One simulated cable robot: the physics that its drives share."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from cdpr_profiles.jit import bound, jit
from cdpr_sim_bus.robot import motor as motor_physics
from cdpr_sim_bus.robot import servo
from cdpr_sim_bus.robot.motor import sample_of
from cdpr_sim_bus.robot.motor_state import (
    CONTROL_STEP_S,
    LOAD_KINDS,
    MOTOR_DTYPE,
    MotorArray,
    Transmission,
)
from cdpr_sim_bus.robot.platform import (
    PLATFORM_DTYPE,
    PlatformArray,
    RobotShape,
    build_platform,
    step_platform,
    update_cable_ends,
)
from cdpr_sim_bus.robot.robot_plant import RobotPlant

# Motors, cables and platform of one robot, advanced together (compiled).

_STATE = ("position", "velocity", "rotation", "spin", "bent", "standing")
"""Fields of a platform that say where it is."""
_TIME, _RINGING, _DYING = 1e-12, 0.15, 0.4
_MOST_STEPS = 400


@jit
def update_ends(platform: Any, motors: Any) -> None:
    """Update the position of the far end of each motor's cable; see `update_cable_ends`."""
    update_cable_ends(platform[0], motors)


@jit
def stable_steps(motors: Any, p: Any, h: float) -> int:
    """Return the number of steps in `h` for which the stiffest cable is integrated stably.

    A rotor on a cable oscillates at sqrt(EA c² / (l J)), with c the cable paid out per radian. The
    platform on all cables and its feet oscillates at sqrt(mobility EA / l); the mobility (1/kg) is
    its acceleration per unit of cable force. In one step, damping must not reverse the motion.
    """
    most, stiffness, damping = 1, 0.0, 0.0
    if p.standing:
        stiffness, damping = p.feet * p.floor_stiffness, p.feet * p.floor_damping
    for m in motors:
        length, gain = motor_physics.paid_out(m)
        k = m.rigidity / length
        stiffness += k
        damping += k * m.damping_time
        swing = math.sqrt(k * gain * gain / m.inertia)
        most = max(most, m.steps_per_control, math.ceil(swing * h / _RINGING))
    most = max(most, math.ceil(math.sqrt(stiffness * p.mobility) * h / _RINGING))
    return int(min(_MOST_STEPS, max(most, math.ceil(damping * p.mobility * h / _DYING))))


@jit
def run_together(
    motors: Any, platform: Any, until: float, kinds: Any, targets: Any, flags: Any
) -> None:
    """Advance all motors and the platform to bus time `until`; OR their flags into `flags`."""
    p = platform[0]
    dt = until - motors[0].time
    if dt <= _TIME:
        return
    n = max(1, math.ceil(dt / CONTROL_STEP_S - 1e-6))
    h = dt / n
    start = motors[0].time
    for i in range(p.cables):
        motor_physics.warm_up(motors[i], dt, kinds[i] != servo.OFF)
    for k in range(n):
        for i in range(p.cables):
            flags[i] |= servo.control(motors[i], kinds[i], targets[i], h)
        parts = stable_steps(motors, p, h)
        for _ in range(parts):
            update_cable_ends(p, motors)
            for i in range(p.cables):
                m = motors[i]
                motor_physics.step_rotor(m, h / parts, m.torque_demand, kinds[i] != servo.OFF)
                flags[i] |= motor_physics.step_disc(m)
            step_platform(p, motors, h / parts)
        for i in range(p.cables):
            m = motors[i]
            m.time = start + (k + 1) * h
            motor_physics.remember_angle(m)
            servo.observe(m, motor_physics.read_counter(m, m.angle), h)
    for i in range(p.cables):
        motors[i].time = until
        flags[i] |= servo.watch(motors[i], kinds[i], targets[i], dt)


_LONGEST_STEP_S = 1e-3
_SAME_TIME_S = 1e-12
FloatArray = NDArray[np.float64]
MotorSample = tuple[int, int, int, int, float, float, float, float, float, float]
"""A `motor.Sample` as the kernels return it."""
MotorCommand = Callable[[], tuple[int, float]]
"""Returns the control mode of a power stage, named in `servo`, and its target."""


class _State:
    """All that `run_together` reads and writes, in one buffer that can be copied and compared."""

    def __init__(self, n: int) -> None:
        kinds = (MOTOR_DTYPE, n), (PLATFORM_DTYPE, 1), (np.int64, n), (np.int64, n), (np.float64, n)
        sizes = [np.dtype(kind).itemsize * count for kind, count in kinds]
        self.bytes: NDArray[np.uint8] = np.zeros(sum(sizes), np.uint8)
        ends = np.cumsum(sizes)
        self.motors: MotorArray
        self.platform: PlatformArray
        self.flags: NDArray[np.int64]
        self.motors, self.platform, self.flags, self._kinds, self._targets = (
            self.bytes[end - size : end].view(kind)
            for (kind, _), size, end in zip(kinds, sizes, ends, strict=True)
        )
        self._kinds[:] = servo.OFF
        then = 0.0, self._kinds, self._targets, self.flags
        self._run = bound(run_together, self.motors, self.platform, then=then)
        self._samples = [bound(sample_of, self.motors[i : i + 1], then=(0,)) for i in range(n)]

    def command(self, commands: Sequence[MotorCommand]) -> None:
        """Store the present commands of the power stages."""
        kinds, targets = self._kinds, self._targets
        for i, command in enumerate(commands):
            kinds[i], targets[i] = command()

    def run(self, until: float) -> None:
        """Advance the whole robot to bus time `until`, with the stored commands."""
        self._run(until, self._kinds, self._targets, self.flags)

    def sample(self, i: int, flags: int) -> MotorSample:
        """Return the `motor.Sample` of motor `i`."""
        sample: MotorSample = self._samples[i](flags)
        return sample


class CableRobot:
    """Motors, cables and platform; each drive advances it and reads its own motor.

    The first drive that requests a time advances the whole robot, with the present commands of all
    power stages. While the bus waits for its master, `prepare` computes the next step in advance on
    a copy.
    """

    def __init__(
        self, shape: RobotShape, plant: RobotPlant, transmissions: Sequence[Transmission]
    ) -> None:
        self.n = n = len(transmissions)
        self._state = _State(n)
        self._ahead = _State(n)
        """Copy of the state, for the step computed in advance."""
        self._ahead_until = self._now = 0.0
        self._ahead_from = b""
        """State before the step computed in advance, with the commands, as bytes."""
        self.motors = self._state.motors
        """One record per motor, filled by `adopt`."""
        self._flags = self._state.flags
        self._plant = plant
        self._rng = np.random.default_rng([plant.seed, 1])
        self._transmissions = list(transmissions)
        self._weights = list(shape.weights_N_m)
        self._slips = sorted(plant.cables.slips, key=lambda slip: slip.at_s)
        self.platform = self._state.platform
        self.platform[:] = build_platform(shape, plant, n, self._rng)
        self._at_start = self.platform.copy()
        # compile now, before the clock runs
        self._state.run(0.0)
        self.commands: list[MotorCommand] = [lambda: (servo.OFF, 0.0)] * n
        """Functions that return the present command of each power stage."""

    def adopt(self, i: int, motor: MotorArray, command: MotorCommand) -> MotorArray:
        """Connect motor `i`, a record of shape (1,), to its cable; return the record to use."""
        self.commands[i] = command
        self.motors[i] = motor[0]
        motor = self.motors[i : i + 1]
        plant, transmission = self._plant.cables, self._transmissions[i]
        error = float(self._rng.normal(0.0, plant.drum_radius_sigma))
        if plant.drum_radius_errors:
            error += plant.drum_radius_errors[i]
        gain = transmission.cable_m_per_rad * (1.0 + error)
        motor["load_kind"] = LOAD_KINDS.index("platform")
        motor["cable_gain"] = gain
        self._attach(i)
        known_s, true_s = transmission.cable_damping_s, plant.damping_s
        motor["damping_time"] = known_s if true_s is None else true_s
        motor["creep_share"] = plant.creep_shares
        motor["creep_rate"] = 1.0 / np.array(plant.creep_times_s)
        motor["winch_friction"] = plant.winch_friction_Nm
        motor["friction_share"] = plant.friction_share * abs(gain)
        winding = self._plant.winding
        motor["drum_gain"] = 1.0 / transmission.gear_ratio
        radius = gain * transmission.gear_ratio
        motor["gear_yield"] = radius**2 / self._plant.winding.gear_stiffness_Nm_rad
        motor["run_out"] = winding.run_out_m
        motor["run_out_phase"] = self._rng.uniform(0.0, 2.0 * math.pi)
        motor["lag"] = winding.carriage_error * winding.pitch_m / (2.0 * math.pi)
        motor["carriage_offset"] = winding.carriage_offset_m
        motor["carriage_distance"] = winding.carriage_distance_m
        motor["angle_start"] = motor["angle"]
        motor["cable_start"] = self._slack_length_m(i)
        return motor

    def _attach(self, i: int) -> None:
        """Connect cable `i` with the platform."""
        plant, motor = self._plant.cables, self.motors[i : i + 1]
        stiffness_N = self._transmissions[i].cable_stiffness_N
        motor["rigidity"] = stiffness_N * (1.0 + plant.stiffness_error)
        motor["weight"] = self._weights[i] if plant.sag else 0.0
        motor["creep"] = 0.0

    def _slack_length_m(self, i: int) -> float:
        """Return the length of cable `i` with the initial slack, for the present pose."""
        slack_m = np.broadcast_to(self._plant.start.slack_m, self.n)
        return self.distance_m(i) + float(slack_m[i])

    def _slack_start_m(self, i: int) -> float:
        """Return the `cable_start` that gives cable `i` this length at the present motor angle."""
        motor = self.motors[i]
        reeled_m = float(motor["cable_gain"] * (motor["angle"] - motor["angle_start"]))
        return self._slack_length_m(i) - reeled_m

    def step(self, i: int, until: float) -> MotorSample:
        """Advance the whole robot to `until`; return the `motor.Sample` of motor `i`."""
        if until - self._now > _SAME_TIME_S:
            self._advance(until)
        while self._slips and self._slips[0].at_s <= self._now:
            due = self._slips.pop(0)
            self.slip(due.cable - 1, due.slip_m)
        flags, self._flags[i] = int(self._flags[i]), 0
        return self._state.sample(i, flags)

    def _advance(self, until: float) -> None:
        state, now = self._state, self._now
        state.command(self.commands)
        if until == self._ahead_until and state.bytes.tobytes() == self._ahead_from:
            state.bytes[:] = self._ahead.bytes
            self._now = until
            return
        while until - now > _SAME_TIME_S:
            now = min(until, now + _LONGEST_STEP_S) if until - now > 1.5e-3 else until
            state.run(now)
        self._now = now

    def prepare(self, until: float) -> None:
        """Compute the step to `until` in advance; it is used if nothing changes before."""
        state, ahead = self._state, self._ahead
        if until == self._ahead_until or not _SAME_TIME_S < until - self._now <= 1.5e-3:
            return
        state.command(self.commands)
        ahead.bytes[:] = state.bytes
        self._ahead_from, self._ahead_until = ahead.bytes.tobytes(), until
        ahead.run(until)

    def members(self) -> list[RobotMember]:
        """Return each motor's part in the robot."""
        return [RobotMember(self, i) for i in range(self.n)]

    @property
    def position_m(self) -> FloatArray:
        """True position of the platform's origin, (3,)."""
        p = self.platform[0]
        return np.asarray(p["position"] - p["rotation"] @ p["com"])

    @property
    def rotation(self) -> FloatArray:
        """True rotation from the platform's frame to the room, (3, 3)."""
        return np.array(self.platform[0]["rotation"])

    @property
    def velocity_m_s(self) -> FloatArray:
        """True velocity of the platform's origin, (3,)."""
        p = self.platform[0]
        return np.asarray(p["velocity"] - np.cross(p["spin"], p["rotation"] @ p["com"]))

    def truth(self) -> dict[str, list[float]]:
        """Return the true pose and motion of the platform, the rotation matrix row by row."""
        return {
            "position_m": self.position_m.tolist(),
            "rotation": self.rotation.ravel().tolist(),
            "velocity_m_s": self.velocity_m_s.tolist(),
            "spin_rad_s": self.platform[0]["spin"].tolist(),
        }

    @property
    def tension_N(self) -> FloatArray:
        """True tension of each cable at its winch, (n,)."""
        return np.array(self.motors["winch_tension"])

    def cut(self, i: int) -> None:
        """Cut cable `i`."""
        self.motors["rigidity"][i] = 1e-9
        self.motors["weight"][i] = 0.0

    def slip(self, i: int, metres: float) -> None:
        """Let this length of cable `i` slip through its fastening on the drum."""
        self.motors["cable_start"][i] += metres

    def mend(self, i: int, cut: bool, slipped_m: float) -> None:
        """Attach cable `i` again if it was cut, and undo its slip.

        If that would pull the platform, the cable gets the initial slack instead. A tight cable
        stays as it is.
        """
        start_m, loose_m = float(self.motors["cable_start"][i]), self._slack_start_m(i)
        if cut:
            self._attach(i)
        else:
            loose_m = min(loose_m, start_m)
        self.motors["cable_start"][i] = max(start_m - slipped_m, loose_m)

    def push(self, k: int, newton: float) -> None:
        """Push the platform's centre of mass along axis `k` of the room, from 0."""
        self.platform["push"][0, k] = newton

    def block(self, stiffness_N_m: float) -> None:
        """Hold the centre of mass by an obstacle where it is; 0 removes the obstacle."""
        self.platform["block_stiffness"] = stiffness_N_m
        self.platform["block"] = self.platform["position"]

    def load(self, kilogram: float) -> None:
        """Put this mass at the platform's centre of mass, instead of any earlier one."""
        p, before = self.platform[0], self._at_start[0]
        p["mass"] = before["mass"] + kilogram
        p["mobility"] = before["mobility"] - 1.0 / before["mass"] + 1.0 / p["mass"]

    def put_back(self) -> None:
        """Put the platform at rest at its start pose.

        Cables that are too short get the initial slack: whoever carries the platform turns their
        winches, or pulls the cable through a winch that has power.
        """
        for name in _STATE:
            self.platform[name] = self._at_start[name]
        for i in range(self.n):
            motor = self.motors[i]
            short_m = self._slack_start_m(i) - float(motor["cable_start"])
            if short_m > 0.0 and motor["kind"] == servo.OFF:
                motor["angle"] += short_m / float(motor["cable_gain"])
                motor["velocity"] = 0.0
            elif short_m > 0.0:
                motor["cable_start"] += short_m

    def distance_m(self, i: int) -> float:
        """Return the distance of cable `i` from exit to anchor point, over its pulley, m."""
        update_ends(self.platform, self.motors)
        return float(self.motors["far_distance"][i])


@dataclass(frozen=True)
class RobotMember:
    """One motor's part in the robot, for the drive that it belongs to."""

    robot: CableRobot
    number: int

    def adopt(self, motor: MotorArray, command: MotorCommand) -> MotorArray:
        """See `CableRobot.adopt`."""
        return self.robot.adopt(self.number, motor, command)

    def step(self, until: float) -> MotorSample:
        """See `CableRobot.step`."""
        return self.robot.step(self.number, until)

    def prepare(self, until: float) -> None:
        """See `CableRobot.prepare`."""
        self.robot.prepare(until)

    def cut(self) -> None:
        """See `CableRobot.cut`."""
        self.robot.cut(self.number)

    def slip(self, metres: float) -> None:
        """See `CableRobot.slip`."""
        self.robot.slip(self.number, metres)

    def mend(self, cut: bool, slipped_m: float) -> None:
        """See `CableRobot.mend`."""
        self.robot.mend(self.number, cut, slipped_m)
