"""One simulated motor with its inner loops: the compiled step and a plain object around it."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

from cdpr_sim_bus.jit import jit
from cdpr_sim_bus.robot import motor_physics, servo
from cdpr_sim_bus.robot.motor_state import (
    CONTROL_STEP_S,
    MotorArray,
    MotorRatings,
    Transmission,
    build_motor,
)
from cdpr_sim_bus.robot.plant import Plant


class Sample(NamedTuple):
    """What `run` returns: the drive's feedback at the end of the step, then the truth."""

    flags: int
    """Flags of `rotor` (index edges) and `servo`, or-ed."""
    counts: int
    """Encoder counter from power-up, `feedback_delay_s` old, with noise."""
    torque_units: int
    """Measured torque in the drive's unit, at the nominal torque constant."""
    velocity_counts_s: int
    """Displayed velocity."""
    angle_rad: float
    """True mechanical angle over all turns, and below the other true figures."""
    velocity_rad_s: float
    motor_Nm: float
    """inertia × acceleration = motor − cogging − friction + pull of the cable."""
    cogging_Nm: float
    friction_Nm: float
    rise_K: float


@jit
def sample_of(
    motor: Any, flags: int
) -> tuple[int, int, int, int, float, float, float, float, float, float]:
    """Return the `Sample` of a motor as it is now, with the flags of its last steps."""
    m = motor[0]
    return (
        flags | servo.switches(m),
        motor_physics.read_counter(m, motor_physics.delayed_angle(m)),
        math.floor(m.sensed / m.torque_unit + 0.5),
        math.floor(m.displayed_velocity + 0.5),
        m.angle,
        m.velocity,
        m.true_gain * m.sensed,
        m.cogging_Nm,
        m.friction_Nm,
        m.rise,
    )


@jit
def run(
    motor: Any, until: float, kind: int, target: float
) -> tuple[int, int, int, int, float, float, float, float, float, float]:
    """Advance one motor to bus time `until` under one kind of control; see `Sample`."""
    m = motor[0]
    dt = until - m.time
    flags = 0
    if dt > 0.0:
        energised = kind != servo.OFF
        n = max(1, math.ceil(dt / CONTROL_STEP_S - 1e-6))
        h = dt / n
        start = m.time
        motor_physics.warm_up(m, dt, energised)
        for i in range(n):
            flags |= servo.control(m, kind, target, h)
            for _ in range(m.steps_per_control):
                motor_physics.step_rotor(m, h / m.steps_per_control, m.torque_demand, energised)
                flags |= motor_physics.step_disc(m)
            m.time = start + (i + 1) * h
            motor_physics.remember_angle(m)
            servo.observe(m, motor_physics.read_counter(m, m.angle), h)
        m.time = until
        flags |= servo.watch(m, kind, target, dt)
    return sample_of(motor, flags)


class Motor:
    """A motor without a drive: its power stage acts at once and no fault is detected."""

    def __init__(
        self,
        plant: Plant,
        ratings: MotorRatings | None = None,
        transmission: Transmission | None = None,
    ) -> None:
        self.ratings = ratings or MotorRatings()
        self.plant = plant
        self.record: MotorArray = build_motor(plant, self.ratings, transmission)
        self.time_s = 0.0

    def step(self, dt_s: float, kind: int, target: float) -> Sample:
        """Advance by `dt_s` seconds; `kind` and `target` as named in `cdpr_sim_bus.robot.servo`."""
        self.time_s += dt_s
        return Sample(*run(self.record, self.time_s, kind, target))
