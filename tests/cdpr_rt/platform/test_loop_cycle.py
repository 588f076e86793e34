"""The controller's model of one cycle of robot and loop, another model, and physics."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import assume, given, seed
from hypothesis import strategies as st

from cdpr_rt.arrays import FloatArray
from cdpr_rt.platform.loop_design import (
    STIFFNESS_SHARES,
    LoopModel,
    Mode,
    SwingsError,
    cycle_matrix,
    design_poses,
    dies_down,
    least_damped,
)
from cdpr_rt.platform.loop_plant import (
    CABLE_DAMPING_s,
    LoopGains,
    geometric_stiffness,
    linear_plant,
    planned_tensions,
)
from cdpr_sim_bus.robot.plant import Plant
from cdpr_sim_bus.robot.robot_plant import CablesPlant, PlatformPlant, RobotPlant, WindingPlant
from tests.cdpr_rt.platform.linear_cycle import (
    loop_model,
    mass_matrix,
    radius_at,
    rigidity,
    robot_of,
    rotors,
)
from tests.cdpr_rt.platform.platform_physics import (
    PERIOD_S,
    Machine,
    Physics,
    crossed_rod,
    planar,
    shipped,
    short_arms,
)

LATE_S, LITTLE_s = 4e-3, 2e-4


def cycle_of(
    machine: Machine,
    gains: LoopGains,
    q: FloatArray,
    tension_N: FloatArray,
    period_s: float,
    share: float = 1.0,
) -> FloatArray:
    """Return the controller's matrix of a cycle at a set-point (d,) under tensions (n,)."""
    model = machine.model()
    pose = model.pose(q)
    nothing = np.zeros(0, complex)
    plant = linear_plant(model, q, rotors(machine), rigidity(machine), nothing, ())
    # J = P (modes)^-1, so coordinates along the modes are those of J's pseudo-inverse
    J = model.kinematics.jacobian(pose)
    along = np.linalg.pinv(J) @ plant.pulls
    K_G = along.T @ geometric_stiffness(model, pose, tension_N) @ along
    M = mass_matrix(machine, q)
    np.testing.assert_allclose(along.T @ M @ along, np.diag(plant.mass_kg), atol=1e-9)
    mass = plant.mass_kg + gains.rotor_kg
    inertial = 2.0 * 0.55 * gains.bandwidth_rad_s * mass
    damping = 1.0 / (1.0 / inertial + 1.0 / gains.damping_N_s_m)
    law = gains, damping, damping**2 / (4.0 * 0.55**2 * mass), period_s, CABLE_DAMPING_s
    return cycle_matrix(plant, share, plant.stiffness_N_m[0], K_G, rotors(machine), *law)


@pytest.mark.parametrize("make", [planar, short_arms, crossed_rod])
def test_a_cycle_has_the_largest_eigenvalue_of_the_other_model(make: Callable[[], Machine]) -> None:
    machine = make()
    model = loop_model(machine)
    gains = model.design()
    for q in model.poses[[1, -1]]:
        for tension_N in planned_tensions(machine.model(), machine.model().pose(q)):
            for follows_pose, period_s in ((False, LATE_S), (True, 1e-3)):
                used = replace(gains, follows_pose=follows_pose)
                expected = radius_at(machine, used, q, 0.7, period_s, tension_N)
                cycle = cycle_of(machine, used, q, tension_N, period_s, 0.7)
                found = np.abs(np.linalg.eigvals(cycle)).max()
                assert found == pytest.approx(expected, rel=1e-9)


def test_shorter_cycles_than_the_drives_delay_change_damping_little() -> None:
    """Half the cycle with the same loop differs little: most of the delay is the drive's."""
    machine = planar()
    model = loop_model(machine)
    gains, q = model.design(), model.poses[1]
    tension_N = planned_tensions(machine.model(), machine.model().pose(q))[0]
    found = [
        least_damped(cycle_of(machine, gains, q, tension_N, period_s), period_s)
        for period_s in (0.9e-3, 0.7e-3, 0.35e-3)
    ]
    ratios = [mode.damping_ratio for mode in found]
    assert ratios[0] < ratios[1] < ratios[2] < 1.5 * ratios[0]


def test_least_damped_finds_frequency_and_damping_of_an_oscillator() -> None:
    rate, ratio, period_s = 60.0, 0.03, 1e-3
    angle = rate * math.sqrt(1.0 - ratio**2) * period_s
    turn = np.array([[math.cos(angle), -math.sin(angle)], [math.sin(angle), math.cos(angle)]])
    swinging = math.exp(-ratio * rate * period_s) * turn
    cycle = np.zeros((3, 3))
    cycle[:2, :2], cycle[2, 2] = swinging, 0.5
    mode = least_damped(np.array([0.5 * np.eye(3), cycle]), period_s)
    assert mode.damping_ratio == pytest.approx(ratio)
    assert mode.frequency_Hz == pytest.approx(angle / period_s / math.tau)
    assert math.exp(-ratio * rate * mode.dies_down_s) == pytest.approx(0.02)
    drifting = least_damped(np.array([[1.001, 0.0], [0.0, 0.9]]), period_s)
    assert drifting == Mode(0.0, pytest.approx(-1.0))


def plate() -> Machine:
    """A light plate under high tensions, which a loop with cycles of 4 ms excites at 33 Hz."""
    anchors = np.array(short_arms().platform.anchor_points_m) * 1.72
    platform = replace(
        short_arms().platform,
        mass_kg=0.61,
        inertia_kg_m2=(0.0038,),
        anchor_points_m=tuple(map(tuple, anchors)),
    )
    return replace(short_arms(), platform=platform, low_N=39.0, high_N=174.0)


def late_plate() -> LoopModel:
    """Return the model of `plate` with such cycles, in the middle and at a corner of its box."""
    return LoopModel(*robot_of(plate()), LATE_S, design_poses(plate().model())[[1, -1]])


def largest(
    machine: Machine,
    gains: LoopGains,
    poses: FloatArray,
    period_s: float,
    cable_damping_s: float = CABLE_DAMPING_s,
) -> float:
    """Return the other model's largest eigenvalue magnitude over tensions and cable stiffness."""
    model = machine.model()
    return max(
        radius_at(machine, gains, q, share, period_s, tension_N, cable_damping_s)
        for q in poses
        for tension_N in planned_tensions(model, model.pose(q))
        for share in STIFFNESS_SHARES
    )


def test_a_loop_that_swings_despite_its_margin_is_designed_again(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    machine, model = plate(), late_plate()
    gains = model.design()
    assert not gains.follows_pose
    assert largest(machine, gains, model.poses, LATE_S) < 1.0
    assert min(mode.damping_ratio for mode in model.least_damped(gains, CABLE_DAMPING_s)) > 0.0

    monkeypatch.setattr(LoopModel, "dies_down", lambda *_: True)
    by_margin = model.design()
    assert largest(machine, by_margin, model.poses, LATE_S) > 1.0
    assert min(mode.damping_ratio for mode in model.least_damped(by_margin, CABLE_DAMPING_s)) < 0.0


def test_a_robot_that_every_loop_excites_is_rejected() -> None:
    """With cables that damp nothing."""
    machine, poses = plate(), late_plate().poses
    where = r"at \(0\.00, -?\d\.\d\d, \d\.\d\d\) m, turned by \((-?\d\.\d\d(, )?){3}\) rad$"
    with pytest.raises(
        SwingsError, match=r"a mode of the loop at [\d.]+ Hz is unstable with .* " + where
    ):
        LoopModel(*robot_of(machine), LATE_S, poses, 0.0).design()


def test_a_loop_is_weaker_for_cables_with_little_known_damping() -> None:
    machine, period_s = shipped("planar-3"), 1e-3
    assumed = loop_model(machine, period_s)
    leaning, poses = assumed.design(), assumed.poses
    assert largest(machine, leaning, poses, period_s, LITTLE_s) > 1.0
    assert largest(machine, leaning, poses, period_s) < 1.0

    known = LoopModel(*robot_of(machine), period_s, poses, LITTLE_s)
    gains = known.design()
    assert largest(machine, gains, poses, period_s, LITTLE_s) < 1.0
    assert largest(machine, gains, poses, period_s) < 1.0
    assert min(there.modulus for there in known.margins(gains)) > 0.4
    same = LoopModel(*robot_of(machine), period_s, poses, 2.0 * CABLE_DAMPING_s)
    assert same.design() == leaning


@given(st.integers(1, 5), st.integers(0, 2**32 - 1), st.floats(0.9, 1.1))
@seed(15)
def test_powers_vanish_if_all_eigenvalues_are_inside_the_circle(
    n: int, chance: int, radius: float
) -> None:
    """Radii within 1e-4 of the circle are left out: their powers take long."""
    assume(abs(radius - 1.0) > 1e-4)
    cycles = np.random.default_rng(chance).standard_normal((2, n, n))
    cycles[0] *= radius / np.abs(np.linalg.eigvals(cycles[0])).max()
    cycles[1] *= 0.5 / np.abs(np.linalg.eigvals(cycles[1])).max()
    assert dies_down(cycles) is (radius < 1.0)


@pytest.mark.long
def test_physics_swings_with_the_models_frequency_and_damping() -> None:
    """A plate that its tensions stabilise swings at rest, with winches without friction."""
    machine, q = short_arms(), np.array([0.0, 0.0, 1.0, 0.0, 0.0, 0.0])
    physics = Physics(machine, without_friction())
    physics.go(q)
    physics.run(1.0)
    first = len(physics.true)
    physics.robot.platform[0]["spin"][2] += 1.0
    physics.run(1.2)
    tension_N = np.array(physics.tension_N[first:]).mean(axis=0)
    cycle = cycle_of(machine, physics.control.gains, q, tension_N, PERIOD_S)
    expected = least_damped(cycle, PERIOD_S)
    assert 0.02 < expected.damping_ratio < 0.05

    angle_rad = np.array(physics.true[first:])[:, 5]
    found = zero_crossings(angle_rad - angle_rad[-400:].mean())
    assert found.frequency_Hz == pytest.approx(expected.frequency_Hz, rel=0.01)
    assert found.damping_ratio == pytest.approx(expected.damping_ratio, rel=0.1)


def zero_crossings(swing: FloatArray) -> Mode:
    """Return frequency and damping of the first ten whole periods of a swing."""
    at = np.flatnonzero((swing[:-1] < 0.0) & (swing[1:] >= 0.0))[:11]
    peaks = [float(np.ptp(swing[a:b])) for a, b in itertools.pairwise(at)]
    period_s = float(at[-1] - at[0]) * PERIOD_S / 10.0
    decay = -float(np.polyfit(np.arange(10) * period_s, np.log(peaks), 1)[0])
    return Mode(1.0 / period_s, decay * period_s / math.tau)


def without_friction() -> RobotPlant:
    """Return a plant with motors and cables as in the linear model."""
    friction = Plant().friction.model_copy(
        update={"coulomb_Nm": 0.0, "breakaway_Nm": 0.0, "viscous_Nms_rad": 0.0}
    )
    winding = WindingPlant(
        run_out_m=0.0, carriage_error=0.0, carriage_offset_m=0.0, gear_stiffness_Nm_rad=1e9
    )
    return RobotPlant(
        platform=PlatformPlant(air_Ns_m=0.0),
        cables=CablesPlant(creep_shares=(0.0, 0.0), sag=False, friction_share=0.0),
        winding=winding,
        motor=Plant(cogging=(), friction=friction),
    )


@pytest.mark.parametrize("name", ["planar-4", "suspended-8"])
def test_oscillations_of_shipped_robots_die_down(name: str) -> None:
    machine = shipped(name)
    model = loop_model(machine)
    modes = model.least_damped(model.design(), CABLE_DAMPING_s)
    assert min(mode.damping_ratio for mode in modes) > 0.05
