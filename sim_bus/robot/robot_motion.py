"""Motors, cables and platform of one robot, advanced together (compiled)."""

from __future__ import annotations

import math
from typing import Any

from cdpr_sim_bus.jit import jit
from cdpr_sim_bus.robot import motor_physics, servo
from cdpr_sim_bus.robot.motor_state import CONTROL_STEP_S
from cdpr_sim_bus.robot.platform import step_platform, update_cable_ends

_TIME, _RINGING, _DYING = 1e-12, 0.15, 0.4
_MOST_STEPS = 400


@jit
def update_ends(platform: Any, motors: Any) -> None:
    """Update where the far end of each motor's cable is; see `update_cable_ends`."""
    update_cable_ends(platform[0], motors)


@jit
def stable_steps(motors: Any, p: Any, h: float) -> int:
    """Return the number of steps in `h` that keeps the integration of the stiffest cable stable.

    A rotor on a cable swings at sqrt(EA c² / (l J)), c the cable it pays out per radian; the
    platform on all of them and its feet, its mobility (1/kg) being how lightly it gives way to
    one, at sqrt(mobility EA / l), and their damping must not stop it more than once a step.
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
    """Advance all motors and the platform to bus time `until`; or flags of each to `flags`."""
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
