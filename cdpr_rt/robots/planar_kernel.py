"""One cycle of a planar robot's control, compiled: pose from lengths, wrench, tensions, torques."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from cdpr_rt.exchange import FloatArray
from cdpr_rt.jit import jit

G_m_s2 = 9.80665
_MOST_TURN_rad = 0.02
_SOLVED_m = 1e-9
_STRETCH_SHARE = 0.2

ROBOT = np.dtype(
    [
        ("mass", "<f8"),  # kg, of the platform
        ("period", "<f8"),  # s
        ("inertia", "<f8"),  # kg m2, of each motor
        ("observer", "<f8"),  # rad/s, double pole of the motors' observers
        ("smoother", "<f8"),  # rad/s, double pole of the part of their velocity that is smooth
        ("smooth", "<f8"),  # share of that part in the velocity which is damped
        ("stiffness", "<f8"),  # N/m, of the platform's loop
        ("damping", "<f8"),  # N s/m
        ("integral", "<f8"),  # N/(m s)
        ("loose", "<f8"),  # N s/m, by which cables that work against each other are damped
        ("regulator_N", "<f8"),  # the most that stiffness and damping ask for together
        ("most_N", "<f8"),  # of the integral part, in each direction
        ("breaking", "<f8"),  # by how much faster what sticks is integrated
        ("stuck_m_s", "<f8"),  # speed below which it does
        ("dead_m", "<f8"),  # error around which the integral part fades out and in
    ]
)
"""What a cycle has to know besides the geometry; one row."""
STATE = np.dtype(
    [
        ("position", "<f8", (2,)),  # m, estimated
        ("velocity", "<f8", (2,)),
        ("angle", "<f8"),  # rad, of the platform
        ("integral", "<f8", (2,)),  # N
        ("residual", "<f8"),  # m
        ("awake", "<f8"),  # share of the integral part, 0 to 1
    ]
)
"""What a cycle leaves to the next; one row."""
CABLE = np.dtype(
    [
        # parameters
        ("exit", "<f8", (2,)),
        ("anchor", "<f8", (2,)),
        ("rigidity", "<f8"),  # N, EA
        ("m_per_rad", "<f8"),  # paid out, signed
        ("length_at_zero", "<f8"),  # m, without tension
        ("torque", "<f8"),  # Nm, the motor's limit
        # state
        ("arm", "<f8", (2,)),  # anchor point from the platform's origin, turned with it
        ("way", "<f8", (2,)),  # unit vector from anchor to exit
        ("length", "<f8"),  # m, under tension, as the motor's angle has it
        ("tension", "<f8"),  # N, with which the cable is taken to be stretched
        ("theta", "<f8"),  # observer: angle and velocity of the motor
        ("omega", "<f8"),
        ("lagging", "<f8"),  # rad/s, low-passed once and twice
        ("calm", "<f8"),
    ]
)
"""What belongs to one cable; one row each."""


@jit
def observe(cables: Any, position: FloatArray, rate: float, smoother: float, period: float) -> None:
    """Track each motor's angle and velocity: an observer with a double pole at `rate`.

    A rotor on its cable swings at 50 to 100 Hz, where the latency turns damping into its reverse:
    what is to damp the platform's slow swinging is low-passed by a double pole at `smoother`.
    """
    decay = math.exp(-rate * period)
    weight = 1.0 - math.exp(-smoother * period)
    for i in range(cables.size):
        c = cables[i]
        predicted = c.theta + period * c.omega
        error = position[i] - predicted
        c.theta = predicted + (1.0 - decay * decay) * error
        c.omega += (1.0 - decay) ** 2 / period * error
        c.lagging += weight * (c.omega - c.lagging)
        c.calm += weight * (c.lagging - c.calm)


@jit
def turn_to_equilibrium(state: Any, cables: Any) -> None:
    """Turn the platform by one Newton step to where its tensions have no moment about its origin.

    The model has no rotation of its own: tensions decide it, and it moves with the pose.
    """
    s = state[0]
    cosine, sine = math.cos(s.angle), math.sin(s.angle)
    moment, slope = 0.0, 0.0
    for i in range(cables.size):
        c = cables[i]
        x = cosine * c.anchor[0] - sine * c.anchor[1]
        y = sine * c.anchor[0] + cosine * c.anchor[1]
        wx, wy = c.exit[0] - s.position[0] - x, c.exit[1] - s.position[1] - y
        rho = math.sqrt(wx * wx + wy * wy)
        wx, wy = wx / rho, wy / rho
        across = x * wy - y * wx
        along = -y * wx + x * wy
        moment += c.tension * across
        slope -= c.tension * (x * wx + y * wy + (x * x + y * y - along * across) / rho)
    if slope < 0.0:
        s.angle += min(max(-moment / slope, -_MOST_TURN_rad), _MOST_TURN_rad)


@jit
def locate(state: Any, cables: Any, iterations: int) -> bool:
    """Bring the position up to the cable lengths by Gauss-Newton, eqs. (2.6) to (2.9).

    From the last position on, one or two iterations do. Writes arms, ways, residual; returns
    whether it has converged.
    """
    s = state[0]
    cosine, sine = math.cos(s.angle), math.sin(s.angle)
    n = cables.size
    for i in range(n):
        c = cables[i]
        c.arm[0] = cosine * c.anchor[0] - sine * c.anchor[1]
        c.arm[1] = sine * c.anchor[0] + cosine * c.anchor[1]
    moved = math.inf
    for _ in range(iterations + 1):
        xx, xy, yy, gx, gy, rest = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
        for i in range(n):
            c = cables[i]
            x = c.exit[0] - s.position[0] - c.arm[0]
            y = c.exit[1] - s.position[1] - c.arm[1]
            rho = math.sqrt(x * x + y * y)
            c.way[0], c.way[1] = x / rho, y / rho
            f = rho - c.length
            rest += f * f
            xx += c.way[0] * c.way[0]
            xy += c.way[0] * c.way[1]
            yy += c.way[1] * c.way[1]
            gx += c.way[0] * f
            gy += c.way[1] * f
        s.residual = math.sqrt(rest / n)
        det = xx * yy - xy * xy
        if moved < _SOLVED_m:
            return True
        if not det > 1e-9:
            return False
        dx, dy = (yy * gx - xy * gy) / det, (xx * gy - xy * gx) / det
        s.position[0] += dx
        s.position[1] += dy
        moved = abs(dx) + abs(dy)
    return moved < 1e-6


@jit
def velocity_of(state: Any, cables: Any, smooth: float) -> None:
    """Write the platform's velocity from those of the cables, in the sense of least squares.

    `smooth` is the share of the low-passed velocities in it.
    """
    s = state[0]
    xx, xy, yy, gx, gy = 0.0, 0.0, 0.0, 0.0, 0.0
    for i in range(cables.size):
        c = cables[i]
        rate = c.m_per_rad * (c.omega + smooth * (c.calm - c.omega))
        xx += c.way[0] * c.way[0]
        xy += c.way[0] * c.way[1]
        yy += c.way[1] * c.way[1]
        gx -= c.way[0] * rate
        gy -= c.way[1] * rate
    det = xx * yy - xy * xy
    if det > 1e-9:
        s.velocity[0] = (yy * gx - xy * gy) / det
        s.velocity[1] = (xx * gy - xy * gx) / det


@jit
def estimate(robot: Any, state: Any, cables: Any, position: FloatArray, iterations: int) -> bool:
    """Estimate pose and velocity of the platform from the motors' angles (m,)."""
    r = robot[0]
    observe(cables, position, r.observer, r.smoother, r.period)
    for i in range(cables.size):
        c = cables[i]
        free = c.length_at_zero + c.m_per_rad * c.theta
        c.length = free * (1.0 + c.tension / c.rigidity)
    turn_to_equilibrium(state, cables)
    found = locate(state, cables, iterations)
    velocity_of(state, cables, r.smooth)
    return found


@jit
def shape(
    past: FloatArray,
    place: int,
    wanted: FloatArray,
    speed: FloatArray,
    slope: FloatArray,
    shaped: FloatArray,
) -> int:
    """Average the set-point over the last cycles, so that its acceleration does not step.

    `past` (k, 3, 2) are the last k positions, velocities and accelerations (2,), as `shaped`
    (3, 2) is their mean; `place` is where the oldest is. What swings k cycles a period is not
    set swinging; bounds, straight ways and the place of rest stay as they were. Returns the place
    of what is the oldest next.
    """
    k = past.shape[0]
    for i in range(2):
        shaped[0, i] += (wanted[i] - past[place, 0, i]) / k
        shaped[1, i] += (speed[i] - past[place, 1, i]) / k
        shaped[2, i] += (slope[i] - past[place, 2, i]) / k
        past[place, 0, i], past[place, 1, i], past[place, 2, i] = wanted[i], speed[i], slope[i]
    place += 1
    if place < k:
        return place
    # a sum that goes on for days is begun anew before rounding shows
    for j in range(3):
        for i in range(2):
            total = 0.0
            for n in range(k):
                total += past[n, j, i] - past[0, j, i]
            shaped[j, i] = past[0, j, i] + total / k
    return 0


@jit
def refer(
    cables: Any,
    wanted: FloatArray,
    speed: FloatArray,
    slope: FloatArray,
    reference: FloatArray,
    reference_speed: FloatArray,
    reference_slope: FloatArray,
) -> None:
    """Write the motors' set-points (m,) for the platform's position, velocity, acceleration (2,).

    Eqs. (2.2) and (2.4), with the stretch of each cable taken off.
    """
    for i in range(cables.size):
        c = cables[i]
        x = c.exit[0] - wanted[0] - c.arm[0]
        y = c.exit[1] - wanted[1] - c.arm[1]
        rho = math.sqrt(x * x + y * y)
        free = rho / (1.0 + c.tension / c.rigidity)
        reference[i] = (free - c.length_at_zero) / c.m_per_rad
        reference_speed[i] = -(x * speed[0] + y * speed[1]) / (rho * c.m_per_rad)
        reference_slope[i] = -(x * slope[0] + y * slope[1]) / (rho * c.m_per_rad)


@jit
def correct(
    robot: Any,
    state: Any,
    wanted: FloatArray,
    speed: FloatArray,
    slope: FloatArray,
    share: float,
    wrench: FloatArray,
    force: FloatArray,
) -> None:
    """Write what acts on the platform besides its cables (2,), and the loop's correction (2,).

    `wrench` is known beforehand: weight, and the wanted acceleration reversed. `force` is what the
    cables are to exert besides: proportional to the error of position and velocity, saturated, and
    its integral. `share` is how much of the last cycle's force could be had: while it was not all,
    nothing is integrated that would only ask for more.

    The integral part goes to sleep by a sigmoid where the error is within what cannot be told from
    friction, so that the platform stands still at its target; two thresholds, as in fig. 2.3: once
    asleep it takes twice the error to wake it.
    """
    r, s = robot[0], state[0]
    ex, ey = wanted[0] - s.position[0], wanted[1] - s.position[1]
    px = r.stiffness * ex + r.damping * (speed[0] - s.velocity[0])
    py = r.stiffness * ey + r.damping * (speed[1] - s.velocity[1])
    much = math.sqrt(px * px + py * py) / r.regulator_N
    if much > 1.0:
        px, py = px / much, py / much
    size = math.sqrt(ex * ex + ey * ey)
    threshold = r.dead_m * (2.0 - s.awake)
    moving = abs(speed[0]) + abs(speed[1]) > 0.0
    s.awake = 1.0 if moving else 1.0 / (1.0 + math.exp(-8.0 * (size / threshold - 1.0)))
    gain = s.awake * r.integral * r.period
    if not moving:
        pace = (s.velocity[0] ** 2 + s.velocity[1] ** 2) / r.stuck_m_s**2
        gain *= 1.0 + r.breaking * math.exp(-min(pace, 50.0))
    # beyond its bounds nothing is integrated, except against what keeps it from moving at all
    sticks = s.velocity[0] ** 2 + s.velocity[1] ** 2 < (5.0 * r.stuck_m_s) ** 2
    limited = share < 1.0 or (much > 1.0 and not sticks)
    for k in range(2):
        step = gain * (ex if k == 0 else ey)
        if not limited or step * s.integral[k] < 0.0:
            s.integral[k] = min(max(s.integral[k] + step, -r.most_N), r.most_N)
    force[0], force[1] = px + s.integral[0], py + s.integral[1]
    wrench[0] = -r.mass * slope[0]
    wrench[1] = -r.mass * slope[1] - r.mass * G_m_s2


@jit
def drive(
    robot: Any,
    cables: Any,
    tensions: FloatArray,
    carried: FloatArray,
    inner: FloatArray,
    reference_slope: FloatArray,
    known: FloatArray,
    effort: FloatArray,
    torque: FloatArray,
) -> None:
    """Write the motors' torques (m,) for the tensions wanted, and what is known of the motors.

    `carried` are the tensions without the loop's correction, which is there to overcome friction
    in the winches: with those the cables are stretched. `inner` is the unit vector of tensions
    that move nothing: cables that pull against each other are damped along it, so that they do
    not sing. A cable is asked for its tension whatever its speed: the mechanism is back-drivable.
    """
    r = robot[0]
    against = 0.0
    for i in range(cables.size):
        c = cables[i]
        c.tension += _STRETCH_SHARE * (carried[i] - c.tension)
        against += inner[i] * c.m_per_rad * c.omega
    for i in range(cables.size):
        c = cables[i]
        pull = tensions[i] + r.loose * inner[i] * against
        effort[i] = r.inertia * reference_slope[i] - c.m_per_rad * pull
        torque[i] = min(max(effort[i] + known[i], -c.torque), c.torque)
