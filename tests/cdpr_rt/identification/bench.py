"""A motor, its drive and the 1 kHz cycle in one compiled loop: whole commissionings in seconds.

Independent of the shipped simulator; the controllers' own kernels are used as they are.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numba
import numpy as np

from cdpr_rt.control.compensation import AxisCompensation, Compensation, FrictionFeedforward
from cdpr_rt.control.compensation import _torque as compensate
from cdpr_rt.control.pid import _update as pid_update
from cdpr_rt.control.tuning import design_pid, sweep_gain
from cdpr_rt.control.validation import ValidationMetrics, evaluate, worst
from cdpr_rt.identification.harmonic_model import SecondPass, identify_harmonic_model
from cdpr_rt.identification.thesis import ThesisResult, identify_thesis
from cdpr_rt.identification.windows import SweepData

T = 1e-3
SUB = 20
QUANTUM = 0.003
TABLE = 1 << 15


@dataclass(frozen=True)
class TruePlant:
    terms: tuple[tuple[int, float, float], ...] = ((4, 0.06, 17.0),)  # order, Nm, deg
    offset_terms: tuple[tuple[int, float, float], ...] = ()
    coulomb: float = 0.08
    breakaway: float = 0.10
    stribeck: float = 0.2
    viscous: float = 5e-4
    sigma0: float = 20.0
    sigma1: float = 0.02
    asymmetry: float = 0.1
    kt_error: float = 0.04
    inertia: float = 1.13e-4
    counts: int = 8192
    noise: float = 0.3
    current_Hz: float = 500.0
    delay: float = 0.0005
    cogging_per_K: float = -0.001
    friction_per_K: float = -0.004
    time_constant: float = 600.0
    rise_K: float = 10.0
    seed: int = 7

    def wave(self, terms, angle, derivative=False):
        out = np.zeros_like(angle)
        for n, a, p in terms:
            x = n * angle + math.radians(p)
            out += n * a * np.cos(x) if derivative else a * np.sin(x)
        return out


@numba.njit(cache=True)
def _advance(par, cog, off, applied, motion, hist, head):
    """Return a motor's `motion` (th, w, z, tau and t) one cycle later, and the head of `hist`."""
    (coul, brk, vs, visc, s0, s1, asym, kte, J, _, _, tau_c, _, cpk, fpk, tct, rise) = par
    h, size = T / SUB, cog.size - 1
    th, w, z, tau, t = motion
    lag = 1 - math.exp(-h / tau_c)
    rise_now = rise * (1 - math.exp(-t / tct))
    fc, ff = 1 + cpk * rise_now, 1 + fpk * rise_now
    for _ in range(SUB):
        tau += (applied * (1 + kte) - tau) * lag
        x = th / (2 * math.pi)
        x = (x - math.floor(x)) * size
        lo = int(x)
        pt = x - lo
        c = fc * (cog[lo] * (1 - pt) + cog[lo + 1] * pt)
        c += (1 + kte) * (off[lo] * (1 - pt) + off[lo + 1] * pt)
        g = coul + (brk - coul) * math.exp(-((w / vs) ** 2))
        d = 1 + 0.5 * asym if w >= 0 else 1 - 0.5 * asym
        g *= ff * d
        aa = 1 + h * s0 * abs(w) / g
        A = J / h + s0 * h / aa + s1 / aa + visc * ff
        B = J / h * w + tau - c - s0 * z / aa - s1 * (z / aa - z) / h
        w = B / A
        z = (z + h * w) / aa
        th += h * w
        head = (head + 1) % hist.size
        hist[head] = th
    return (th, w, z, tau, t + T), head


@numba.njit(cache=True)
def _latched(par, hist, head, noise):
    """Return the encoder's reading, which is slightly older than the angle."""
    counts, dsub = par[9], par[12] / (T / SUB)
    dlow = int(dsub)
    dpart = dsub - dlow
    nh = hist.size
    old = hist[(head - dlow) % nh] * (1 - dpart) + hist[(head - dlow - 1) % nh] * dpart
    return math.floor(old / (2 * math.pi) * counts + noise * par[10]) / counts * 2 * math.pi


@numba.njit(cache=True)
def _run(par, cog, off, state, rnd, setp, setv, gains, mode, kp, limit, tables, cpar, cstate, rec):
    motion, pend, carry = (state[0], state[1], state[2], state[3], state[6]), state[4], state[5]
    hist, head = state[8:], int(state[7])
    pstate, means = np.zeros((1, 7)), np.zeros((1, 2))  # nothing looks at the cogging alone
    pos, ref, vel, known = np.zeros(1), np.zeros(1), np.zeros(1), np.zeros(1)
    cogging, eff, out, index = np.zeros(1), np.zeros(1), np.zeros(1), np.zeros(1)
    lim, yes = np.full(1, limit), np.ones(1, np.bool_)
    for k in range(setp.size):
        meas = _latched(par, hist, head, rnd[k])
        applied = pend  # computed in cycle k-1, acts from t_k
        pos[0], ref[0], vel[0] = meas, setp[k], setv[k]
        if mode == 0:
            eff[0] = kp * (setp[k] - meas)
            u = min(max(eff[0], -limit), limit)
        else:
            if mode == 2:
                compensate(
                    tables, means, cpar, cstate, T, T / 0.2, pos, index, yes, ref, vel, known,
                    cogging,
                )  # fmt: skip
            pid_update(gains, lim, T, pstate, pos, ref, vel, known, eff, out)
            u = out[0]
        want = u + carry
        pend = round(want / QUANTUM) * QUANTUM
        carry = want - pend
        th, w, z, tau, t = motion
        rec[k, 0], rec[k, 1], rec[k, 2], rec[k, 3] = t, meas, pend, eff[0]
        rec[k, 4], rec[k, 5], rec[k, 6], rec[k, 7] = th, w, par[4] * z + par[3] * w, tau
        motion, head = _advance(par, cog, off, applied, motion, hist, head)
    state[0], state[1], state[2], state[3] = motion[:4]
    state[4], state[5], state[6], state[7] = pend, carry, motion[4], head


def leg_setpoint(start, speed, cruise, ramp):
    t = np.arange(round((cruise + 2 * ramp) / T)) * T
    shape = np.clip(np.minimum(t / ramp, (cruise + 2 * ramp - t) / ramp), 0, 1)
    pos = np.where(t < ramp, 0.5 * t**2 / ramp, t - 0.5 * ramp)
    left = cruise + 2 * ramp - t
    pos = np.where(left < ramp, cruise + ramp - 0.5 * left**2 / ramp, pos)
    return start + speed * pos, speed * shape


class Bench:
    """One motor that runs legs one after the other and keeps its state between them."""

    def __init__(self, plant: TruePlant) -> None:
        self.plant = p = plant
        angle = np.arange(TABLE + 1) * 2 * np.pi / TABLE
        self.cog = p.wave(p.terms, angle)
        self.off = p.wave(p.offset_terms, angle)
        self.par = (
            p.coulomb,
            p.breakaway,
            p.stribeck,
            p.viscous,
            p.sigma0,
            p.sigma1,
            p.asymmetry,
            p.kt_error,
            p.inertia,
            float(p.counts),
            p.noise,
            1 / (2 * math.pi * p.current_Hz),
            p.delay,
            p.cogging_per_K,
            p.friction_per_K,
            p.time_constant,
            p.rise_K,
        )
        self.state = np.zeros(8 + 512)
        self.rng = np.random.default_rng(p.seed)

    @property
    def rise(self):
        p = self.plant
        return p.rise_K * (1 - math.exp(-self.state[6] / p.time_constant))

    def leg(self, setp, setv, *, kp=0.0, gains=None, comp=None, limit=0.75):
        rec = np.empty((setp.size, 8))
        gain = np.zeros((1, 5))
        tables, cpar, cstate = np.zeros((1, 2, 2)), np.zeros((1, 10)), np.zeros((1, 4))
        mode = 0
        if gains is not None:
            mode = 1
            gain[0] = (
                gains.proportional_Nm_rad,
                gains.integral_Nm_rad_s,
                gains.derivative_Nms_rad,
                gains.derivative_filter_s,
                gains.following_Nm_rad_s,
            )
        if comp is not None:
            mode = 2
            c = Compensation([comp], T)
            tables, cpar = c._tables, c._parameters
        _run(
            self.par,
            self.cog,
            self.off,
            self.state,
            self.rng.standard_normal(setp.size),
            setp,
            setv,
            gain,
            mode,
            kp,
            limit,
            tables,
            cpar,
            cstate,
            rec,
        )
        data = SweepData(rec[:, 0], rec[:, 1], rec[:, 2], setp, setv)
        return data, rec

    def ramp(self, speed_deg, turns, *, lead=0.0, ramp_s=1.0, **kw):
        """A leg of whole turns after `lead` turns of lead-in; speed signed."""
        v = math.radians(speed_deg)
        cruise = (turns + lead) * 2 * math.pi / abs(v)
        setp, setv = leg_setpoint(self.state[0], v, cruise, ramp_s)
        return self.leg(setp, setv, **kw)

    def triangle(self, speed_deg, ramp_s, **kw):
        """A leg that only speeds up and slows down."""
        setp, setv = leg_setpoint(self.state[0], math.radians(speed_deg), 0.0, ramp_s)
        return self.leg(setp, setv, **kw)

    def oracle(self, look_ahead, observer_s, m=4096):
        p = self.plant
        angle = np.arange(m) * 2 * np.pi / m + np.pi / p.counts  # a reading sits half a count low
        table = (1 + p.cogging_per_K * self.rise) * p.wave(p.terms, angle) / (1 + p.kt_error)
        table = table + p.wave(p.offset_terms, angle)
        ff = (1 + p.friction_per_K * self.rise) / (1 + p.kt_error)
        up, dn = ff * (1 + p.asymmetry / 2), ff * (1 - p.asymmetry / 2)
        s = p.breakaway - p.coulomb
        fr = FrictionFeedforward(
            p.coulomb * up, p.coulomb * dn, s * up, s * dn, p.stribeck, p.viscous * ff
        )
        return AxisCompensation(np.vstack([table, table]), fr, look_ahead, observer_s, most_Nm=10.0)


NOMINAL_INERTIA = 1.13e-4
LATENCY = 0.0005 + 1.5 * T + 1 / (2 * math.pi * 500.0)
OBSERVER = 0.003
BANDWIDTH = 12.0
RAMP_SPEED = 22.0


@dataclass
class Commissioned:
    bench: Bench
    thesis: ThesisResult
    second: SecondPass

    @property
    def harmonic(self):
        return self.second.best


def fast_legs(bench):
    """The legs that show inertia, latency and the friction curve, under a stiff PID."""
    gains = design_pid(NOMINAL_INERTIA, LATENCY, 30.0).gains
    legs = [bench.ramp(v, 3, ramp_s=0.1, gains=gains)[0] for v in (300, -300, 600, -600)]
    legs += [bench.triangle(v, 4.0, gains=gains)[0] for v in (90, -90)]
    return legs + [bench.ramp(v, 0.25, ramp_s=0.3, gains=gains)[0] for v in (12, -12)]


def compensation(harmonic):
    look_ahead = max(0.0, harmonic.latency_s.value)
    return AxisCompensation(
        harmonic.tables(4096), harmonic.friction, look_ahead, OBSERVER, most_Nm=10.0
    )


def commission(plant):
    """Sweep, fast legs, then ramps under compensation until they run smoothly."""
    bench = Bench(plant)
    gain = sweep_gain(NOMINAL_INERTIA, LATENCY)
    sweeps = [bench.ramp(v, 2, lead=0.05, kp=gain)[0] for v in (3, -3)]
    fast = fast_legs(bench)
    first = identify_harmonic_model(sweeps + fast, NOMINAL_INERTIA, LATENCY, 4)
    second = SecondPass(first, fast)
    while not second.done:
        gains = design_pid(second.current.inertia_kg_m2.value, LATENCY, BANDWIDTH).gains
        known = compensation(second.current)
        second.add(
            [
                bench.ramp(v, 1, lead=0.1, ramp_s=0.5, gains=gains, comp=known)[0]
                for v in (RAMP_SPEED, -RAMP_SPEED)
            ]
        )
    return Commissioned(bench, identify_thesis(sweeps), second)


def judged_turns(setpoint_rad, setpoint_velocity_rad_s, lead_in_rad):
    """Mark the whole turns at constant speed that follow the lead-in of one leg, (k,)."""
    speed = np.abs(setpoint_velocity_rad_s)
    cruise = np.flatnonzero(speed > (1.0 - 1e-9) * speed.max())
    travelled = np.abs(setpoint_rad - setpoint_rad[cruise[0]])
    turns = math.floor((travelled[cruise[-1]] - lead_in_rad) / (2.0 * math.pi) + 1e-3)
    assert turns >= 1
    marked = np.zeros(speed.size, np.bool_)
    inside = travelled[cruise] >= lead_in_rad
    inside &= travelled[cruise] < lead_in_rad + turns * 2.0 * math.pi
    marked[cruise[inside]] = True
    return marked


def validate(done: Commissioned) -> dict[str, ValidationMetrics]:
    """The ramps of the thesis' validation in both directions, judged by the true angle."""
    bench, plant = done.bench, done.bench.plant
    gains = design_pid(done.harmonic.inertia_kg_m2.value, LATENCY, BANDWIDTH).gains
    latency = plant.delay + 1.5 * T + 1 / (2 * math.pi * plant.current_Hz)
    result = {}
    for name in ("harmonic", "oracle", "none", "thesis"):
        runs = []
        for v in (RAMP_SPEED, -RAMP_SPEED):
            known = {
                "none": lambda: None,
                "thesis": lambda: AxisCompensation(done.thesis.tables(4096), most_Nm=10.0),
                "harmonic": lambda: compensation(done.harmonic),
                "oracle": lambda: bench.oracle(latency, OBSERVER),
            }[name]()
            run, rec = bench.ramp(v, 1, lead=0.3, gains=gains, comp=known)
            judged = judged_turns(run.setpoint_rad, run.setpoint_velocity_rad_s, 0.6 * math.pi)
            runs.append(
                evaluate(
                    rec[:, 4], run.setpoint_rad, run.setpoint_velocity_rad_s, rec[:, 3], T, judged
                )
            )
        result[name] = worst(runs)
    return result
