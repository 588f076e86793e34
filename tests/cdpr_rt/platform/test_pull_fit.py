"""Friction, cogging and lengths found as cables are pulled tight around a standing platform."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from cdpr_profiles import load_robot
from cdpr_rt.model.platform_model import platform_model_of
from cdpr_rt.platform.cable_control import CableControl, slides_on_stand
from cdpr_rt.platform.motor_learning import MotorLearning
from cdpr_rt.platform.pull_fit import FRICTION, PullFit

ROBOT = load_robot("suspended-6")
N, POLE_PAIRS = 6, 4
AXES = [
    replace(axis, winch=replace(axis.winch, cable_sign=1 - 2 * (i % 2)))
    for i, axis in enumerate(ROBOT.axes)
]
"""Every other winch pays out in the opposite direction."""
CABLE_m = np.array([axis.winch.cable_m_per_motor_rad for axis in AXES])
PRETENSION_N = np.full(N, 80.0)
FRICTION_Nm = np.array([0.04, 0.08, 0.12, 0.06, 0.10, 0.09])
PHASE_rad = np.array([0.3, 1.5, 2.6, 3.9, 5.0, 6.1])
COGGING_Nm = np.array([0.06, 0.03, 0.0, 0.07, 0.05, 0.06])
START_rad = 40.0
NOBODY = np.zeros(N, np.bool_)
STANDS = np.zeros((N, 0))
SLIDES = slides_on_stand(platform_model_of(ROBOT))


@pytest.fixture(scope="module")
def lengths() -> Callable[[np.ndarray], np.ndarray]:
    limits = np.full(N, 4.0)
    control = CableControl(platform_model_of(ROBOT), list(ROBOT.axes), limits, 1e-3)
    return control.lengths_at_home


class Winches:
    """Motors with friction and cogging, without inertia, that pull at cables fixed at home."""

    def __init__(
        self,
        lengths: Callable[[np.ndarray], np.ndarray],
        gain: float = 1.0,
        pretension_N: np.ndarray = PRETENSION_N,
        friction_Nm: np.ndarray = FRICTION_Nm,
        harmonic_Nm: float = 0.0,
    ) -> None:
        """Take the ratio of exerted to requested torque, `gain`, and a third harmonic."""
        self.tensions_N, self.gain = np.linspace(0.1, 300.0, 600), gain
        self.harmonic_Nm = harmonic_Nm
        self.pretension_N, self.friction_Nm = pretension_N, friction_Nm
        self.free_m = np.array([lengths(np.full(N, t)) for t in self.tensions_N])
        self.at_pretension_rad = np.full(N, START_rad)
        self.theta = self.at_pretension_rad + 4.0 * np.sign(CABLE_m)
        self.zero_m = lengths(pretension_N) - CABLE_m * self.at_pretension_rad

    def pull(self, tension_N: np.ndarray) -> None:
        """Turn each motor as far as its friction lets it."""
        for i in range(N):
            turns = self.theta[i] + np.linspace(-6.0, 6.0, 6001)
            held = np.interp(
                -self.zero_m[i] - CABLE_m[i] * turns, -self.free_m[:, i], self.tensions_N
            )
            cogging = COGGING_Nm[i] * np.sin(POLE_PAIRS * turns + PHASE_rad[i])
            cogging += self.harmonic_Nm * np.sin(3.0 * POLE_PAIRS * turns + i)
            left = CABLE_m[i] * (held - self.gain * tension_N[i]) - cogging
            stays = np.abs(left) <= self.friction_Nm[i]
            self.theta[i] = turns[stays][np.abs(turns[stays] - self.theta[i]).argmin()]


def pulled(
    fit: PullFit, winches: Winches, moved_m: float | np.ndarray = 0.0, moved_at: int = 60
) -> np.ndarray:
    """Return the angles found by pulling from the pretension down, up and back to it."""
    pretension_N = winches.pretension_N
    fit.prepare(pretension_N)
    winches.pull(pretension_N)
    fit.begin(winches.theta)
    shares = np.concatenate(
        [np.linspace(1.0, 0.5, 40), np.linspace(0.5, 1.5, 80), np.linspace(1.5, 1.0, 40)]
    )
    for k, share in enumerate(shares):
        if k == moved_at:  # the platform moves along with its cables
            winches.zero_m += moved_m
        winches.pull(share * pretension_N)
        fit.take(winches.theta, share * pretension_N)
    return fit.end()


def off_N(found_rad: np.ndarray, winches: Winches) -> np.ndarray:
    softness = (winches.free_m[150] - winches.free_m[170]) / (
        winches.tensions_N[170] - winches.tensions_N[150]
    )
    return CABLE_m * (found_rad - winches.at_pretension_rad) / softness


def test_lengths_are_found_free_of_friction_and_cogging(
    lengths: Callable[[np.ndarray], np.ndarray],
) -> None:
    winches = Winches(lengths)
    learning = MotorLearning(AXES, NOBODY, np.ones(N), 500.0, 1e-3)
    fit = PullFit(AXES, NOBODY, lengths, learning, STANDS)
    found = pulled(fit, winches)
    assert not learning.learnt_Nm.any()  # before the platform is known to stand at home
    fit.begin_learning()
    left_N = np.abs(off_N(winches.theta, winches))
    assert left_N.max() > 10.0  # friction and cogging where the motors rest
    assert np.abs(off_N(found, winches)).max() < 2.0
    # friction in motion is taken to be four fifths of it, and nothing is more than 8 % of rated
    np.testing.assert_allclose(learning.friction_Nm, 0.8 * FRICTION_Nm, atol=0.012)
    # cables so stiff that motors turn by two thirds of a period
    assert not learning.cogging_Nm.any()


def test_cogging_is_found_if_motors_turn_by_a_period(
    lengths: Callable[[np.ndarray], np.ndarray],
) -> None:
    loose_m = lengths(np.zeros(N))

    def softer(tension_N: np.ndarray) -> np.ndarray:
        return loose_m - 4.0 * (loose_m - lengths(tension_N))

    learning = MotorLearning(AXES, NOBODY, np.ones(N), 500.0, 1e-3)
    fit = PullFit(AXES, NOBODY, softer, learning, STANDS)
    pulled(fit, Winches(softer))
    fit.begin_learning()
    cogging = np.stack([COGGING_Nm * np.cos(PHASE_rad), COGGING_Nm * np.sin(PHASE_rad)], axis=1)
    np.testing.assert_allclose(learning.cogging_Nm, cogging, atol=0.015)


@pytest.mark.parametrize("stiffness", [0.7, 1.3])
def test_friction_is_found_with_cables_softer_or_stiffer_than_in_the_file(
    lengths: Callable[[np.ndarray], np.ndarray], stiffness: float
) -> None:
    loose_m = lengths(np.zeros(N))

    def true_lengths(tension_N: np.ndarray) -> np.ndarray:
        return loose_m - (loose_m - lengths(tension_N)) / stiffness

    fit = PullFit(AXES, NOBODY, lengths, None, STANDS)
    pulled(fit, Winches(true_lengths))
    np.testing.assert_allclose(fit.unknowns[:, FRICTION], FRICTION_Nm, atol=0.012)


@pytest.mark.parametrize("alike", [True, False])
def test_a_motor_whose_friction_never_reverses_takes_that_of_similar_motors(
    lengths: Callable[[np.ndarray], np.ndarray], alike: bool
) -> None:
    """Every other cable has so little tension that its winch turns only inwards."""
    little = np.arange(N) % 2 == 1
    pretension_N = np.where(little, 26.0, 80.0)
    winches = Winches(lengths, pretension_N=pretension_N, friction_Nm=np.linspace(0.15, 0.19, N))
    gears = np.where(little & (not alike), 11.0, 10.0)
    axes = [
        replace(axis, winch=replace(axis.winch, gear_ratio=gear, drum_radius_m=gear / 100.0))
        for axis, gear in zip(AXES, gears, strict=True)
    ]
    learning = MotorLearning(axes, NOBODY, np.ones(N), 500.0, 1e-3)
    fit = PullFit(axes, NOBODY, lengths, learning, STANDS)
    assert (np.isfinite(pulled(fit, winches)) == (alike | ~little)).all()
    fit.begin_learning()
    expected_Nm = 0.8 * winches.friction_Nm if alike else np.zeros(N)
    np.testing.assert_allclose(learning.friction_Nm[little], expected_Nm[little], atol=0.03)


def test_an_extra_load_on_one_motor_does_not_raise_the_friction_of_similar_motors(
    lengths: Callable[[np.ndarray], np.ndarray],
) -> None:
    """Fits with a large residual count little."""
    friction_Nm = np.full(N, 0.12)
    winches = Winches(
        lengths, pretension_N=np.full(N, 50.0), friction_Nm=friction_Nm, harmonic_Nm=0.12
    )
    fit = PullFit(AXES, NOBODY, lengths, None, STANDS)
    assert np.isfinite(pulled(fit, winches)).all()
    np.testing.assert_allclose(fit.unknowns[:, FRICTION], friction_Nm, atol=0.06)


def test_a_wrong_torque_constant_is_not_taken_for_cogging(
    lengths: Callable[[np.ndarray], np.ndarray],
) -> None:
    """Only a load cell could show it: the true pretension is 5 % above the requested one."""
    winches = Winches(lengths, gain=1.05)
    fit = PullFit(AXES, NOBODY, lengths, None, STANDS)
    found = pulled(fit, winches)
    wrong_N = 0.05 * PRETENSION_N
    assert np.abs(np.abs(off_N(found, winches)) - wrong_N).max() < 2.5


def test_a_platform_that_moves_during_the_pull_gives_no_lengths(
    lengths: Callable[[np.ndarray], np.ndarray],
) -> None:
    fit = PullFit(AXES, NOBODY, lengths, None, STANDS)
    assert np.isnan(pulled(fit, Winches(lengths), moved_m=0.02)).all()


@pytest.mark.parametrize(
    ("slide_mm", "known", "told"), [(4.0, 0, True), (0.1, 0, False), (4.0, 1, False)]
)
def test_a_significant_slide_on_the_stand_is_corrected(
    lengths: Callable[[np.ndarray], np.ndarray], slide_mm: float, known: int, told: bool
) -> None:
    """The platform slides at 1.25 times the pretension; lengths at home are those before.

    They are not corrected if some motors are identified.
    """
    slid_m = SLIDES @ (1e-3 * slide_mm * np.array([0.6, -0.8, 0.5]))
    stood, of = Winches(lengths), np.arange(N) < known
    still_N = off_N(pulled(PullFit(AXES, of, lengths, None, SLIDES), stood), stood)
    off = []
    for slides in (SLIDES, STANDS):
        winches = Winches(lengths)
        fit = PullFit(AXES, of, lengths, None, slides)
        off_by_N = off_N(pulled(fit, winches, -slid_m, 100), winches) - still_N
        off.append(np.abs(off_by_N[~of]).max())
    assert off[0] < 0.5 * off[1] if told else off[0] == off[1]


def test_nothing_is_found_for_motors_that_are_identified_or_do_not_turn(
    lengths: Callable[[np.ndarray], np.ndarray],
) -> None:
    known = np.arange(N) % 2 == 0
    learning = MotorLearning(AXES, known, np.ones(N), 500.0, 1e-3)
    fit = PullFit(AXES, known, lengths, learning, STANDS)
    assert (np.isnan(pulled(fit, Winches(lengths))) == known).all()
    fit.begin_learning()
    assert not learning.friction_Nm[known].any() and learning.friction_Nm[~known].all()
    learning.forget()
    fit.begin(np.zeros(N))
    for _ in range(50):
        fit.take(np.zeros(N), PRETENSION_N)
    assert np.isnan(fit.end()).all()
    fit.begin_learning()
    assert not learning.friction_Nm.any()


def test_learning_again_keeps_the_known_friction(
    lengths: Callable[[np.ndarray], np.ndarray],
) -> None:
    """For example when cables are tightened again after learning in motion."""
    learning = MotorLearning(AXES, NOBODY, np.ones(N), 500.0, 1e-3)
    fit = PullFit(AXES, NOBODY, lengths, learning, STANDS)
    pulled(fit, Winches(lengths))
    fit.begin_learning()
    before_Nm, bounds_Nm = learning.friction_Nm.copy(), learning.most_Nm.copy()
    fit.unknowns[:, FRICTION] *= 0.5
    fit.begin_learning()
    assert (learning.friction_Nm == before_Nm).all() and (learning.most_Nm == bounds_Nm).all()
    learning.forget()
    fit.begin_learning()
    assert (learning.friction_Nm < 0.6 * before_Nm).all()


@pytest.mark.parametrize("reserve_N", [3.0, 20.0, 500.0])
def test_identified_friction_leaves_a_third_of_the_tension_reserve(
    lengths: Callable[[np.ndarray], np.ndarray], reserve_N: float
) -> None:
    learning = MotorLearning(AXES, NOBODY, np.ones(N), reserve_N, 1e-3)
    fit = PullFit(AXES, NOBODY, lengths, learning, STANDS)
    pulled(fit, Winches(lengths))
    fit.begin_learning()
    added_Nm = learning.friction_Nm + np.linalg.norm(learning.cogging_Nm, axis=1)
    third_Nm = reserve_N / 3.0 * np.abs(CABLE_m)
    assert (learning.friction_Nm > 0.0).all()
    assert learning.most_Nm[2] == pytest.approx(2.0 * third_Nm)
    assert (learning.most_Nm[0] <= 2.0 * third_Nm + 1e-12).all()
    assert (learning.most_Nm[1] <= third_Nm + 1e-12).all()
    assert (learning.friction_Nm <= learning.most_Nm[0]).all()
    if reserve_N == 20.0:  # here friction exceeds a third of the reserve, and cogging does not
        assert (learning.friction_Nm > 1.05 * third_Nm).any()
    assert np.isfinite(added_Nm).all()
    learning.forget()
    assert (learning.most_Nm[:2] <= third_Nm + 1e-12).all()
