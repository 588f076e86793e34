"""One simulated motor: its current, cogging, friction, rotor, cable and encoder, in one step."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from cdpr_profiles.jit import jit
from cdpr_sim_bus.robot import servo
from cdpr_sim_bus.robot.motor_state import (
    CONTROL_STEP_S,
    CREEPS,
    DELAY_SLOTS,
    LINE_COUNTS,
)

# Physics of one motor: current loop, cogging, LuGre friction, rotor, encoder disc (compiled).

INDEX_ROSE = 1
INDEX_FELL = 2
PLATFORM = 3
"""`load_kind` of a motor whose cable leads to a platform."""
_SHORTEST_m = 0.02
_SLACK_N = 1e-3


@jit
def random_bits(m: Any) -> Any:
    """Draw 64 bits: SplitMix64."""
    m.random += np.uint64(0x9E3779B97F4A7C15)
    z = m.random
    z = (z ^ (z >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
    z = (z ^ (z >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
    return z ^ (z >> np.uint64(31))


@jit
def gaussian(m: Any) -> float:
    """Draw from the standard normal distribution, by the Box-Muller transform."""
    z = random_bits(m)
    u = (float(z >> np.uint64(32)) + 0.5) * 2.0**-32
    v = float(z & np.uint64(0xFFFFFFFF)) * 2.0**-32
    return math.sqrt(-2.0 * math.log(u)) * math.cos(2.0 * math.pi * v)


@jit
def step_rotor(m: Any, h: float, demand: float, energised: bool) -> None:
    """Advance the physics by `h` seconds under a torque demand (Nm, nominal).

    Implicit Euler in bristle and velocity, so that any bristle stiffness stays stable;
    LuGre: dz/dt = v − σ0|v|z/g(v), F = σ0 z + σ1 dz/dt + viscous·v (Canudas de Wit et al., 1995).
    """
    cogging = 0.0
    for k in range(m.n_torque):
        cogging += m.amplitude[k] * math.sin(m.order[k] * m.angle + m.phase[k])
    cogging *= 1.0 + m.cogging_per_K * m.rise
    offset = 0.0
    if energised:
        offset -= m.torque_bias
        if not math.isnan(m.torque_stuck):
            demand = m.torque_stuck
        demand = max(-m.torque_cap, min(m.torque_cap, demand))
        for k in range(m.n_torque, m.n_cogging):
            offset += m.amplitude[k] * math.sin(m.order[k] * m.angle + m.phase[k])
    # The loop controls the measured current to the demand; the true current lacks the sensors'
    # offset.
    m.current += (1.0 - math.exp(-m.current_rate * h)) * (demand - offset - m.current)
    if abs(m.current) < 1e-30:
        m.current = 0.0  # denormal numbers would double the time of every step
    m.sensed = m.current + offset
    gain = m.torque_gain
    if m.sixth > 0.0 or m.twelfth > 0.0:
        x = m.ripple_order * m.angle + m.ripple_phase
        sine = math.sin(x)
        gain *= 1.0 + sine * (m.sixth + 2.0 * m.twelfth * math.cos(x))  # sin 2x = 2 sin x cos x
    m.true_gain = gain
    torque = gain * m.current - cogging

    w, z = m.velocity, m.bristle
    warm = max(0.0, 1.0 + m.friction_per_K * m.rise)
    side = 1.0 + 0.5 * m.asymmetry * math.copysign(1.0, w if w != 0.0 else z)
    ratio = w / m.stribeck
    level = m.coulomb + (m.breakaway - m.coulomb) * math.exp(-ratio * ratio)
    if m.rubbing > 0.0:
        side *= 1.0 + m.rubbing * math.sin(m.angle + m.rubbing_phase)
    g = max(1e-9, warm * side * level + m.load_friction)
    viscous = warm * m.viscous
    s0, s1, inertia = m.sigma0, m.sigma1, m.inertia
    aa = 1.0 + h * s0 * abs(w) / g
    A = inertia / h + s0 * h / aa + s1 / aa + viscous
    B = inertia / h * w + torque - s0 * z / aa - s1 * (z / aa - z) / h
    w = B / A if m.load_kind == 0 and m.brake == 0.0 else turn_loaded(m, h, A, B)
    z_new = (z + h * w) / aa
    m.friction_Nm = s0 * z_new + s1 * (z_new - z) / h + viscous * w
    m.cogging_Nm = cogging + gain * offset
    m.bristle = z_new
    m.velocity = w
    m.angle += h * w


@jit
def braked(m: Any, A: float, B: float) -> float:
    """Return the velocity w of A·w = B under the dry friction of the brake."""
    if abs(B) <= m.brake:
        return 0.0
    return float((B - math.copysign(m.brake, B)) / A)


@jit
def turn_loaded(m: Any, h: float, A: float, B: float) -> float:
    """Return the rotor's new velocity, A·w = B without load, and move the load.

    The cable is a damped spring that cannot push. Implicit Euler over rotor, cable and mass
    together is stable for any stiffness. It adds a damping of `h` seconds to `cable_damping_s`.
    """
    if m.load_kind == 0:
        return braked(m, A, B)
    if m.load_kind == PLATFORM:
        return wind(m, h, A, B)
    c = m.cable_gain
    stretch = m.cable_start + m.mass_position - c * (m.angle - m.angle_start)
    pull = m.cable_stiffness * stretch
    b = h * m.cable_stiffness + m.cable_damping
    landing = (m.floor - m.mass_position) / h if m.load_kind == 1 else 0.0
    # tension = pull + b·(v − c·w); the mass moves with v = v0 + v1·w
    w, v, tension = 0.0, 0.0, -1.0
    if m.load_kind == 1:
        heavy = m.mass / h + b
        v0 = (m.mass * (m.mass_velocity / h + m.gravity) - pull) / heavy
        v1 = b * c / heavy
        w = braked(m, A + c * b * (c - v1), B + c * (pull + b * v0))
        v = v0 + v1 * w
        tension = pull + b * (v - c * w)
    if m.load_kind == 2 or v > landing:
        v = landing  # the mass stands on the floor, or the cable's end is fixed
        w = braked(m, A + c * b * c, B + c * (pull + b * v))
        tension = pull + b * (v - c * w)
    if tension <= 0.0 or stretch + h * (v - c * w) <= 0.0:
        tension = 0.0
        w = braked(m, A, B)
        v = min(m.mass_velocity + h * m.gravity, landing)
    m.mass_velocity = v
    m.mass_position += h * v
    m.tension = m.winch_tension = tension
    m.load_friction = m.winch_friction + m.friction_share * tension
    return w


@jit
def cable_force(stretch: float, stiffness: float, sag: float, last: float) -> tuple[float, float]:
    """Return tension and its derivative with respect to `stretch`, for an elastic cable that sags.

    stretch = t / stiffness - sag / t²; the second part is the excess length of a flat parabola over
    its chord (Irvine, Cable Structures, 1981). A slack cable without weight has no tension.
    Newton's method starts from the last tension. Below the root it converges without overshoot,
    because the curve is concave.
    """
    if sag <= 0.0:
        if stretch <= 0.0:
            return 0.0, 0.0
        return stretch * stiffness, stiffness
    t = max(last, _SLACK_N)
    slope = 0.0
    for _ in range(40):
        slope = 1.0 / stiffness + 2.0 * sag / (t * t * t)
        step = (stretch - t / stiffness + sag / (t * t)) / slope
        t = max(t + step, 0.25 * t)
        if abs(step) <= 1e-9 * t:
            break
    return t, 1.0 / slope


@jit
def paid_out(m: Any) -> tuple[float, float]:
    """Return the unstretched cable between exit point and platform, m, and its rate, m/rad.

    An eccentric drum adds and removes cable once a turn. A carriage that is beside its cable leads
    it along the hypotenuse of the distance to the drum and the offset.
    """
    turned = m.angle - m.angle_start
    length = m.cable_start + m.cable_gain * turned
    gain = m.cable_gain
    drum = m.drum_gain
    if m.run_out > 0.0:
        phase = m.run_out_phase + drum * turned
        length += m.run_out * (math.sin(phase) - math.sin(m.run_out_phase))
        gain += m.run_out * drum * math.cos(phase)
    if m.lag > 0.0 or m.carriage_offset != 0.0:
        away = m.carriage_distance
        off = m.carriage_offset + m.lag * drum * turned
        askew = math.hypot(away, off)
        length -= askew - math.hypot(away, m.carriage_offset)
        gain -= off / askew * m.lag * drum
    return max(_SHORTEST_m, length), gain


@jit
def wind(m: Any, h: float, A: float, B: float) -> float:
    """Return the new velocity w of a rotor whose cable holds a platform.

    Without load A·w = B. During the step the platform stands still, because it is heavy; the
    tension found here moves it afterwards. The spring acts at its present length (symplectic
    Euler), damping is implicit. The compliance of gear and belt adds to the cable's stretch. A
    hanging cable has the potential energy -w L drop/2, with its weight w per length. So the
    platform bears half of the cable's weight, `hung_load`. At the winch the tension exceeds that
    in the middle of the cable by w drop/2. Creep is a strain
    that follows a share of the elastic one, d(creep)/dt = (share · t / EA - creep) / time: a chain
    of Kelvin-Voigt elements.
    """
    length, c = paid_out(m)
    hanging = m.weight * length * m.far_level
    sag = hanging * hanging * length / 24.0
    stiffness = 1.0 / (length / m.rigidity + m.gear_yield)
    crept = length * (1.0 + m.creep[0] + m.creep[1])
    pull, slope = cable_force(m.far_distance - crept, stiffness, sag, m.tension)
    d = m.damping_time * slope
    more = 0.5 * m.weight * m.far_drop
    w = braked(m, A + c * d * c, B + c * (pull + more + d * m.far_rate))
    tension = pull + d * (m.far_rate - c * w)
    if tension <= 0.0:
        tension = 0.0
        w = braked(m, A, B + c * more)
    m.tension, m.winch_tension = tension, max(0.0, tension + more)
    m.hung_load = 0.5 * m.weight * max(0.0, length - m.far_wound)
    m.load_friction = m.winch_friction + m.friction_share * tension
    for k in range(CREEPS):
        m.creep[k] += h * m.creep_rate[k] * (m.creep_share[k] * tension / m.rigidity - m.creep[k])
    return w


@jit
def step_disc(m: Any) -> int:
    """Move the encoder disc to the rotor's angle; latch the counter at index pulse edges.

    The pulse is one count wide. Returns INDEX_ROSE and INDEX_FELL, OR-ed.
    """
    old = m.disc
    new = math.floor(m.angle * m.counts_per_rad + 0.5)
    m.disc = new
    if new == old or m.index_present == 0:
        return 0
    edges, n, x = 0, m.counts_per_turn, m.index
    if new > old:
        pulse = x + (new - x) // n * n
        if pulse > old:
            edges |= INDEX_ROSE
            m.rise_count = pulse - m.zero
        pulse = x + (new - 1 - x) // n * n
        if pulse >= old:
            edges |= INDEX_FELL
            m.fall_count = pulse + 1 - m.zero
    else:
        pulse = x - (x - new) // n * n
        if pulse < old:
            edges |= INDEX_ROSE
            m.rise_count = pulse - m.zero
        pulse = x - (x - new - 1) // n * n
        if pulse <= old:
            edges |= INDEX_FELL
            m.fall_count = pulse - 1 - m.zero
    return edges


@jit
def restart_counter(motor: Any) -> None:
    """Restart the counter at zero at the rotor's present angle, as at power-up."""
    m = motor[0]
    m.zero = m.disc
    m.rise_count = 0
    m.fall_count = 0


@jit
def read_counter(m: Any, angle: float) -> int:
    """Return the encoder counter for a rotor angle, with the disc's errors, noise and rounding."""
    if m.frozen != 0:
        return int(m.frozen_count)
    reading = angle * m.counts_per_rad
    if m.eccentricity > 0.0:
        reading += m.eccentricity * math.sin(angle + m.eccentric_phase) - m.eccentric_zero
    if m.interpolation > 0.0:
        reading += m.interpolation * math.sin(2.0 * math.pi / LINE_COUNTS * reading)
    if m.noise > 0.0:
        reading += m.noise * gaussian(m)
    counts: int = math.floor(reading + 0.5) - m.zero
    return counts


@jit
def remember_angle(m: Any) -> None:
    """Store time and angle for the delayed reading, unless the last ones are too recent."""
    if (m.time - m.slot_time[m.slot]) * (DELAY_SLOTS // 2) >= m.delay:
        m.slot = (m.slot + 1) % DELAY_SLOTS
        m.slot_time[m.slot] = m.time
        m.slot_angle[m.slot] = m.angle


@jit
def delayed_angle(m: Any) -> float:
    """Return the rotor angle `delay` ago, plus or minus jitter, interpolated from stored angles."""
    sample_time = m.time - m.delay
    if m.jitter > 0.0:
        unit = float(random_bits(m) >> np.uint64(11)) * 2.0**-53
        sample_time = min(m.time, sample_time + m.jitter * (2.0 * unit - 1.0))
    after_time, after = m.time, m.angle
    for back in range(DELAY_SLOTS):
        k = (m.slot - back) % DELAY_SLOTS
        before_time, before = m.slot_time[k], m.slot_angle[k]
        if before_time <= sample_time:
            if before_time == -math.inf or after_time <= before_time:
                return float(before)
            share = (sample_time - before_time) / (after_time - before_time)
            return float(before + share * (after - before))
        after_time, after = before_time, before
    return float(after)


@jit
def warm_up(m: Any, dt: float, energised: bool) -> None:
    """Let the temperature rise follow its first-order law for `dt` seconds."""
    goal = m.rise_limit if energised else 0.0
    m.rise += (1.0 - math.exp(-m.heating_rate * dt)) * (goal - m.rise)


class Sample(NamedTuple):
    """Result of `run`: the drive's feedback at the end of the step, then the truth."""

    flags: int
    """Flags of `rotor` (index edges) and `servo`, OR-ed."""
    counts: int
    """Encoder counter from power-up, `feedback_delay_s` old, with noise."""
    torque_units: int
    """Measured torque in the drive's unit, at the nominal torque constant."""
    velocity_counts_s: int
    """Displayed velocity."""
    angle_rad: float
    """True mechanical angle over all turns; the following values are also true."""
    velocity_rad_s: float
    motor_Nm: float
    """Motor torque: inertia × acceleration = motor − cogging − friction + pull of the cable."""
    cogging_Nm: float
    friction_Nm: float
    rise_K: float


@jit
def sample_of(
    motor: Any, flags: int
) -> tuple[int, int, int, int, float, float, float, float, float, float]:
    """Return the present `Sample` of a motor, with the flags of its last steps."""
    m = motor[0]
    return (
        flags | servo.switches(m),
        read_counter(m, delayed_angle(m)),
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
    """Advance one motor to bus time `until` in one control mode; see `Sample`."""
    m = motor[0]
    dt = until - m.time
    flags = 0
    if dt > 0.0:
        energised = kind != servo.OFF
        n = max(1, math.ceil(dt / CONTROL_STEP_S - 1e-6))
        h = dt / n
        start = m.time
        warm_up(m, dt, energised)
        for i in range(n):
            flags |= servo.control(m, kind, target, h)
            for _ in range(m.steps_per_control):
                step_rotor(m, h / m.steps_per_control, m.torque_demand, energised)
                flags |= step_disc(m)
            m.time = start + (i + 1) * h
            remember_angle(m)
            servo.observe(m, read_counter(m, m.angle), h)
        m.time = until
        flags |= servo.watch(m, kind, target, dt)
    return sample_of(motor, flags)
