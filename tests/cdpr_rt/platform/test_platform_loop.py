"""A platform's loop: its gains, and its margins compared with a time-domain model."""

from __future__ import annotations

import dataclasses
from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from cdpr_profiles import RobotAxis
from cdpr_rt.arrays import FloatArray
from cdpr_rt.diagnosis.loop_checks import loop_stiffness
from cdpr_rt.model.cable_kernel import CABLE_ROWS, run_cables
from cdpr_rt.model.pose import Pose
from cdpr_rt.platform import body_kernel
from cdpr_rt.platform import loop_kernel as loop
from cdpr_rt.platform.body_kernel import body_of
from cdpr_rt.platform.loop_design import (
    FOLLOWED_MARGIN,
    LEAST_MARGIN,
    STIFFNESS_SHARES,
    LoopModel,
    keeps_margin,
)
from cdpr_rt.platform.loop_plant import DAMPING_RATIO, LoopGains, planned_tensions
from tests.cdpr_rt.platform.linear_cycle import (
    loop_model,
    mass_matrix,
    radius,
    rigidity,
    rotors,
    turned_wrench,
)
from tests.cdpr_rt.platform.platform_physics import (
    PERIOD_S,
    Machine,
    crossed_rod,
    heavier,
    planar,
    shipped,
    short_arms,
    spatial,
)

MACHINES = {
    "planar-3": planar,
    "spatial": spatial,
    "short arms": short_arms,
    "crossed rod": crossed_rod,
}
SHIPPED = ("planar-4", "point-4", "suspended-8")


@cache
def designed(name: str, period_s: float = PERIOD_S) -> tuple[Machine, LoopModel, LoopGains]:
    """Return a machine, its model and the gains that are designed with it."""
    machine = MACHINES[name]() if name in MACHINES else shipped(name)
    model = loop_model(machine, period_s)
    return machine, model, model.design()


# -- gains


class Loop:
    """`loop_kernel.correct` at a pose, without integral part."""

    def __init__(self, machine: Machine, gains: LoopGains, q: FloatArray) -> None:
        self.model = model = machine.model()
        n, d, kinematics = machine.n, model.size, model.kinematics
        self.settings = np.zeros(loop.SETTINGS)
        for key, value in (
            (loop.PERIOD, PERIOD_S), (loop.BANDWIDTH, gains.bandwidth_rad_s),
            (loop.DAMPING, gains.damping_N_s_m), (loop.RATIO, DAMPING_RATIO),
            (loop.ROTOR, gains.rotor_kg), (loop.REGULATOR_N, 1e12), (loop.MOST_N, 1e12),
            (loop.STICTION_SPEED, 1.0), (loop.DEADBAND, 1.0),
        ):  # fmt: skip
            self.settings[key] = value
        self.pose, self.cables = model.pose(q), np.zeros((CABLE_ROWS, n))
        self.geometry = kinematics.geometry
        run_cables(kinematics.geometry, self.pose.array, self.cables)
        self.directions = np.array(kinematics.directions)
        self.moves, self.n, self.d = np.zeros((4, 6)), n, d
        self.state, self.friction = np.zeros(3 * d + 1), np.zeros(n)
        # a half was known before, a half was learnt
        self.winches = loop.WinchFriction(
            self.friction, np.full(n, 0.25), np.zeros(n), np.full(n, 2.0)
        )
        self.body = body_of(machine.platform)
        self.wrench = np.zeros(d)

    def force(self, share: float = 1.0, apart: float = 0.0) -> FloatArray:
        force, d, n = np.zeros(self.d), self.d, self.n
        self.winches.learnt_Nm[:] = 0.25 * self.friction
        loop.correct(
            self.settings, self.state, self.model.wrench_scale, self.body, self.directions,
            self.geometry, self.cables, self.pose.array, self.moves, np.zeros((7, 7, 7)),
            np.zeros((n, d)), np.zeros((d, n)), np.zeros(n), self.wrench, self.winches, force,
            share, apart,
        )  # fmt: skip
        return force

    def gain(self, row: int, sign: float = 1.0) -> FloatArray:
        """Return the force for a unit in each direction of one row of the moves, (d, d)."""
        columns = []
        for i in self.directions:
            self.moves[:] = 0.0
            self.moves[row, i] = sign
            columns.append(self.force())
        return np.array(columns).T


@pytest.mark.parametrize("name", MACHINES)
def test_gains_are_positive_definite_and_each_mode_has_its_damping_ratio(name: str) -> None:
    machine, model, gains = designed(name)
    for q, told in zip(model.poses, model.margins(gains), strict=True):
        law = Loop(machine, gains, q)
        K, D = law.gain(0), law.gain(3, -1.0)
        np.testing.assert_allclose(law.gain(1), D, rtol=1e-9, atol=1e-9 * np.abs(D).max())
        J = machine.model().kinematics.jacobian(law.pose)
        M = mass_matrix(machine, q) + gains.rotor_kg * J.T @ J
        told_K = loop_stiffness(machine.model(), gains, q)
        np.testing.assert_allclose(told_K, K, rtol=1e-8, atol=1e-8 * np.abs(K).max())
        for gain in (K, D):
            np.testing.assert_allclose(gain, gain.T, atol=1e-9 * np.abs(gain).max())
            assert np.linalg.eigvalsh(gain).min() > 0.0
        squares, modes = np.linalg.eig(np.linalg.solve(M, K))
        omega = np.sqrt(squares.real)
        held = K.copy()
        if not gains.follows_pose:
            least_N = planned_tensions(machine.model(), machine.model().pose(q))[0]
            held += turned_wrench(machine, q, least_N)
        stood = np.sqrt(np.linalg.eigvals(np.linalg.solve(M, held)).real)
        assert stood.min() == pytest.approx(told.slowest_rad_s, rel=1e-4)
        assert stood.max() == pytest.approx(told.fastest_rad_s, rel=1e-4)
        assert omega.max() < gains.bandwidth_rad_s
        damped = 2.0 * DAMPING_RATIO * M @ modes.real * omega
        np.testing.assert_allclose(D @ modes.real, damped, atol=1e-6 * np.abs(damped).max())
        # no cable has more damping than allowed
        orthogonal = np.linalg.eigvals(np.linalg.solve(J.T @ J, D)).real
        assert orthogonal.max() < gains.damping_N_s_m


def test_the_proportional_part_is_bounded_and_the_damping_is_not() -> None:
    """The proportional part is bounded, the damping is not."""
    machine = planar()
    gains = loop_model(machine).design()
    law = Loop(machine, gains, np.array([0.1, 1.9]))
    law.settings[loop.REGULATOR_N] = 30.0
    law.moves[0, 0] = 0.5
    far = law.force()
    assert np.linalg.norm(far) == pytest.approx(30.0)
    law.moves[3, :2] = 0.2, -0.1
    K_D = law.gain(3, -1.0)
    law.moves[:] = 0.0
    law.moves[0, 0] = 0.5
    law.moves[3, :2] = 0.2, -0.1
    assert law.force() == pytest.approx(far - K_D @ [0.2, -0.1])


def test_contradictory_rates_reduce_the_force() -> None:
    machine = planar()
    law = Loop(machine, loop_model(machine).design(), np.array([0.1, 1.9]))
    law.settings[loop.INTEGRAL] = 0.0
    law.moves[0, :2], law.moves[3, :2] = (0.001, -0.002), (0.3, 0.1)
    whole = law.force()
    assert law.force(apart=0.1) == pytest.approx(whole)
    assert law.force(apart=1.5) == pytest.approx(0.01 * whole)


def test_the_integral_does_not_grow_while_the_force_is_limited() -> None:
    machine = planar()
    law = Loop(machine, loop_model(machine).design(), np.array([0.1, 1.9]))
    law.settings[loop.INTEGRAL], law.settings[loop.DEADBAND] = 5.0, 1e-9
    law.moves[0, 0] = 0.01
    law.force(share=0.5)
    assert not law.state[:2].any()
    first = law.force()
    for _ in range(10):
        grown = law.force()
    assert grown[0] > first[0] > 0.0
    law.moves[0, 0] = -0.01
    before = law.state[0]
    law.force(share=0.5)
    assert law.state[0] < before


def test_the_integral_part_sleeps_within_its_deadband_and_wakes_beyond_it() -> None:
    machine = planar()
    law = Loop(machine, loop_model(machine).design(), np.array([0.1, 1.9]))
    law.settings[loop.INTEGRAL], law.settings[loop.DEADBAND] = 5.0, 1e-4
    awake = []
    for error in (3e-4, 1.5e-4, 0.5e-4, 0.5e-4, 1.5e-4, 3e-4, 3e-4):
        law.moves[0, 0] = error
        law.force()
        awake.append(law.state[2])
    assert awake[0] > 0.9
    assert awake[3] < 0.1
    assert awake[4] < 0.2
    assert awake[6] > 0.9
    law.moves[0, 0], law.moves[1, 1] = 0.0, 1e-3
    law.force()
    assert law.state[2] == 1.0


def test_torque_held_by_friction_at_rest_is_released_when_motion_begins() -> None:
    """No more of it than friction can hold; the integral part of the last motion stays."""
    machine = planar()
    law = Loop(machine, loop_model(machine).design(), np.array([0.1, 1.9]))
    law.settings[loop.INTEGRAL], law.settings[loop.DEADBAND] = 5.0, 1e-9
    J = machine.model().kinematics.jacobian(law.pose)

    def cycle(error: float, *, moving: bool, cycles: int = 1) -> FloatArray:
        law.moves[0, 0], law.moves[1, 1] = error, 1e-3 if moving else 0.0
        for _ in range(cycles):
            law.force()
        return law.state[:2].copy()

    in_motion = cycle(0.01, moving=True, cycles=50)
    at_rest = cycle(-0.02, moving=False, cycles=100)
    assert (np.abs(at_rest - in_motion)[:2] > 0.1).all()
    kept = law.state.copy()
    assert cycle(0.0, moving=True) == pytest.approx(at_rest)  # without friction compensation

    law.state[:], law.friction[:] = kept, 1e6
    assert cycle(0.0, moving=True) == pytest.approx(in_motion)
    assert cycle(0.0, moving=True) == pytest.approx(in_motion)

    law.state[:], law.friction[:] = kept, [0.02, 0.01, 0.03]
    least = np.abs(J).T @ law.friction
    expected = at_rest + np.sign(in_motion - at_rest) * least
    assert (least < np.abs(at_rest - in_motion)).all()
    assert cycle(0.0, moving=True) == pytest.approx(expected)
    assert cycle(0.0, moving=True) == pytest.approx(expected)


def test_a_heavier_platform_gets_a_slower_loop() -> None:
    slowest = []
    for mass in (0.5, 2.0, 20.0):
        model = loop_model(heavier(planar(), mass))
        margins = model.margins(model.design())
        assert min(m.modulus for m in margins) >= LEAST_MARGIN
        slowest.append(min(m.slowest_rad_s for m in margins))
    assert slowest[0] > slowest[1] > slowest[2]


def test_the_lightest_rotor_limits_the_damping() -> None:
    machine = planar()
    winch = machine.axes[0].winch
    geared = replace(machine.axes[0], winch=replace(winch, gear_ratio=8.0))  # four times as heavy
    light = machine.axes[0]

    def damping(*axes: RobotAxis) -> float:
        gains = loop_model(dataclasses.replace(machine, axes=axes)).design()
        return gains.null_damping_N_s_m * (1.0 - gains.smooth)

    assert damping(geared, light, geared) == pytest.approx(damping(light, light, light))
    assert damping(geared, geared, geared) == pytest.approx(4.0 * damping(light, light, light))


# -- margins


@pytest.mark.parametrize(
    ("name", "period_s"),
    [
        *((name, PERIOD_S) for name in (*MACHINES, *SHIPPED)),
        *((name, 2e-3) for name in ("planar-3", "crossed rod")),
    ],
)
def test_loops_are_stable_with_any_stiffness(name: str, period_s: float) -> None:
    machine, model, gains = designed(name, period_s)
    margins = model.margins(gains)
    least = FOLLOWED_MARGIN if gains.follows_pose else LEAST_MARGIN
    assert min(one.modulus for one in margins) >= least
    for q in model.poses[:: max(1, len(model.poses) // 5)]:
        for share in STIFFNESS_SHARES:
            assert radius(machine, gains, q, share, period_s) < 1.0


@pytest.mark.parametrize("name", ["planar-3", "crossed rod"])
def test_the_margin_vanishes_where_the_loop_becomes_unstable(name: str) -> None:
    """Damping is scaled by g and stiffness by g² until eigenvalues leave the circle."""
    machine, model, by_design = designed(name)
    q = model.poses[1]
    there = LoopModel(machine.model(), rotors(machine), rigidity(machine), PERIOD_S, poses=q[None])

    def scaled(g: float) -> LoopGains:
        return replace(
            by_design,
            bandwidth_rad_s=g * by_design.bandwidth_rad_s,
            damping_N_s_m=g * by_design.damping_N_s_m,
        )

    def stable(g: float) -> bool:
        gains = scaled(g)
        return all(radius(machine, gains, q, k, PERIOD_S) < 1.0 for k in STIFFNESS_SHARES)

    # with a modulus margin μ a loop stays stable up to 1/(1 - μ) times its gain
    assert stable(1.2)
    low, high = 1.2, 20.0
    assert not stable(high)
    while high - low > 0.01 * low:
        middle = 0.5 * (low + high)
        low, high = (middle, high) if stable(middle) else (low, middle)
    moduli = [there.margins(scaled(g))[0].modulus for g in (1.0, 0.5 * (1.0 + low), low)]
    assert moduli[0] >= (FOLLOWED_MARGIN if by_design.follows_pose else LEAST_MARGIN)
    assert moduli[0] > moduli[1] > moduli[2]
    assert moduli[2] < 0.15


# Whether a loop keeps its margin, compared with singular values by NumPy.


@pytest.mark.parametrize("coupling", [0.0, 0.02, 0.1, 0.5, 2.0])
@pytest.mark.parametrize("d", [1, 2, 3, 6])
def test_the_margin_is_kept_while_the_least_singular_value_exceeds_it(
    d: int, coupling: float
) -> None:
    rng = np.random.default_rng(17)
    beside = coupling * (1.0 - np.eye(d)) + np.eye(d)
    told = []
    for _ in range(60):
        plants = beside * (rng.normal(size=(2, 2, 3, d, d)) + 1j * rng.normal(size=(2, 2, 3, d, d)))
        of_speed, of_place = rng.normal(size=(2, 3)) + 1j * rng.normal(size=(2, 3))
        damping, stiffness = rng.uniform(0.1, 2.0, (2, 2, d))
        C = np.multiply.outer(damping, of_speed) + np.multiply.outer(stiffness, of_place)
        S = np.eye(d) + C.transpose(0, 2, 1)[:, None, :, :, None] * plants
        least = float(np.linalg.svd(S, compute_uv=False).min())
        for share, kept in ((1.0 - 1e-6, True), (1.0 + 1e-6, False)):
            law = of_speed, of_place, damping, stiffness, share * least
            told.append(keeps_margin(plants, *law, np.zeros((2, d, d), complex)) is kept)
    assert all(told)


# The rigid body, compared with the points that it consists of.

quick = settings(max_examples=60)


def points(rng: np.random.Generator) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return masses (k,), places in the platform's frame (k, 3), and the body's row."""
    m, at = rng.uniform(0.1, 3.0, 7), rng.normal(size=(7, 3))
    body = np.zeros(body_kernel.BODY)
    centre = m @ at / m.sum()
    inertia = np.zeros((3, 3))
    for mass, r in zip(m, at - centre, strict=True):
        inertia += mass * (r @ r * np.eye(3) - np.outer(r, r))
    body[body_kernel.MASS] = m.sum()
    body[body_kernel.CENTRE : body_kernel.CENTRE + 3] = centre
    body[body_kernel.INERTIA : body_kernel.INERTIA + 9] = inertia.ravel()
    body[body_kernel.GRAVITY :] = rng.normal(size=3) * 10.0
    return m, at, body


@quick
@given(st.integers(0, 2**32 - 1))
def test_mass_matrix_and_wrench_equal_those_of_points(seed: int) -> None:
    rng = np.random.default_rng(seed)
    m, at, body = points(rng)
    pose = Pose(rng.normal(size=3), Rotation.from_rotvec(rng.normal(size=3)).as_matrix())
    M, scratch = np.zeros((6, 6)), np.zeros((4, 3))
    body_kernel.write_mass_matrix(body, pose.array, scratch, M)
    r = at @ pose.Q.T
    twist, acceleration = rng.normal(size=(2, 6))
    omega = twist[3:]
    velocity = twist[:3] + np.cross(omega, r)
    assert 0.5 * twist @ M @ twist == pytest.approx(0.5 * m @ (velocity**2).sum(axis=1))
    np.testing.assert_allclose(M, M.T, atol=1e-12)
    wrench = np.zeros(6)
    body_kernel.write_wrench(body, M, scratch, twist, acceleration, wrench)
    pull = acceleration[:3] + np.cross(acceleration[3:], r) + np.cross(omega, np.cross(omega, r))
    forces = m[:, None] * (body[body_kernel.GRAVITY :] - pull)
    wanted = np.concatenate([forces.sum(axis=0), np.cross(r, forces).sum(axis=0)])
    np.testing.assert_allclose(wrench, wanted, atol=1e-10 * np.abs(wanted).max())
