"""The modes PP, PV, PT, CSP, CSV and CST with stiction, cogging and encoder noise."""

from __future__ import annotations

import itertools
import math

import numpy as np
import pytest

from cdpr_sim_bus.robot.plant import Plant
from tests.sim_bus.cia402.drive_rig import SMOOTH, Rig

RAD = 2 * math.pi / 8192
HARD = Plant.model_validate(
    {
        "friction": {"coulomb_Nm": 0.15, "breakaway_Nm": 0.22, "direction_asymmetry": 0.5},
        "cogging": ({"order": 24, "amplitude_Nm": 0.1}, {"order": 4, "kind": "current_offset"}),
    }
)


def plants() -> list[Plant]:
    return [
        Plant(),
        HARD,
        Plant.model_validate({"load": {"inertia_kg_m2": 5e-3}}),
        Plant.model_validate({"encoder": {"noise_counts": 1.0}}),
    ]


def set_point(rig: Rig, target: int, extra: int = 0) -> None:
    """Perform the handshake of profile position mode."""
    rig.write(0x607A, target)
    rig.word = 0x1F | extra
    rig.until(lambda: bool(rig.status & 0x1000), 0.1)
    rig.word = 0x0F | extra
    rig.cycle()


def mean_velocity(rig: Rig, cycles: int = 600) -> float:
    """Return the mean true velocity over some cycles in counts/s."""
    angle = rig.truth[0]
    rig.cycles(cycles)
    return (rig.truth[0] - angle) / (cycles * 1e-3) / RAD


class TestProfilePosition:
    @pytest.mark.parametrize("plant", plants())
    def test_reaches_each_target_and_reports_it(self, plant: Plant) -> None:
        rig = Rig(plant)
        rig.enable(1)
        for target in (8192, 8200, -3000, -3001, 0):
            set_point(rig, target)
            assert not rig.status & 0x0400 or abs(rig.position - target) < 30
            rig.until(lambda: bool(rig.status & 0x0400), 4.0)
            true_counts = rig.truth[0] / RAD
            assert abs(true_counts - target) <= 20
            rig.cycles(200)
            assert rig.status & 0x0400

    def test_follows_the_trapezoid(self, rig: Rig) -> None:
        for index, value in ((0x6081, 20_000), (0x6083, 100_000), (0x6084, 50_000)):
            rig.write(index, value)
        rig.enable(1)
        set_point(rig, 20_000)
        start = rig.now
        speeds, references = [], []
        while not rig.status & 0x0400:
            rig.cycle()
            speeds.append(rig.truth[1] / RAD)
            references.append(rig.read(0x6062, signed=True))
            assert rig.now < start + 3
        # Ramp up 0.2 s, down 0.4 s; 14000 counts remain for 20000 counts/s.
        assert rig.now - start == pytest.approx(0.2 + 0.7 + 0.4, abs=0.06)
        assert np.median(speeds[250:850]) == pytest.approx(20_000, rel=0.02)
        steps = np.diff(references) / 1e-3
        assert steps.max() == pytest.approx(20_000, abs=1500)
        assert references[-1] == 20_000
        assert max(references) <= 20_000

    def test_a_buffered_set_point_follows_the_active_one(self, rig: Rig) -> None:
        rig.enable(1)
        set_point(rig, 8192)
        rig.cycles(5)
        rig.write(0x607A, 0)
        rig.word = 0x1F
        rig.until(lambda: bool(rig.status & 0x1000), 0.1)
        rig.word = 0x0F
        rig.cycle()
        assert rig.status & 0x1000  # the buffer is full
        peak = 0
        for _ in range(1500):
            rig.cycle()
            peak = max(peak, rig.position)
        assert peak >= 8192 - 20
        assert abs(rig.position) < 20
        assert rig.status & 0x1400 == 0x0400

    def test_a_set_point_may_be_immediate_and_relative(self, rig: Rig) -> None:
        rig.enable(1)
        set_point(rig, 80_000)
        rig.cycles(100)
        set_point(rig, -1000, 0x20)
        rig.until(lambda: bool(rig.status & 0x0400), 4.0)
        assert abs(rig.position + 1000) < 20
        set_point(rig, -500, 0x40)
        rig.until(lambda: bool(rig.status & 0x0400), 4.0)
        assert abs(rig.position + 1500) < 20

    def test_software_limit_clamps_the_target(self, rig: Rig) -> None:
        rig.write(0x607D, -1000, 1)
        rig.write(0x607D, 4000, 2)
        rig.enable(1)
        set_point(rig, 9000)
        rig.cycles(1000)
        assert abs(rig.position - 4000) < 20
        assert rig.status & 0x0800

    def test_holds_the_position_when_enabled(self, rig: Rig) -> None:
        rig.write(0x607A, 5000)
        rig.enable(1)
        rig.cycles(500)
        assert abs(rig.truth[0]) < 20 * RAD


class TestVelocity:
    @pytest.mark.parametrize("plant", plants())
    @pytest.mark.parametrize("mode", [3, 9])
    def test_holds_the_velocity(self, plant: Plant, mode: int) -> None:
        rig = Rig(plant)
        rig.enable(mode)
        for target in (20_000, -1000, 300):
            rig.write(0x60FF, target)
            rig.cycles(700)
            mean = mean_velocity(rig)
            # The motor follows a slow reference with stick-slip, up to a few counts behind.
            assert mean == pytest.approx(target, rel=0.02, abs=150)

    def test_velocity_actual_value_follows_the_true_one(self, rig: Rig) -> None:
        rig.enable(3)
        rig.write(0x60FF, 20_000)
        rig.cycles(300)
        shown, true = [], []
        for _ in range(300):
            rig.cycle()
            shown.append(rig.read(0x606C, signed=True))
            true.append(rig.truth[1] / RAD)
        assert np.mean(shown) == pytest.approx(np.mean(true), rel=0.01)
        assert np.std(np.subtract(shown, true)) < 600

    def test_velocity_follows_the_profile_ramps(self, rig: Rig) -> None:
        rig.write(0x6083, 40_000)
        rig.write(0x6084, 80_000)
        rig.enable(3)
        rig.write(0x60FF, 20_000)
        rig.until(lambda: bool(rig.status & 0x0400), 2.0)
        rig.cycles(200)
        begin = rig.now
        rig.write(0x60FF, -20_000)
        rig.cycles(2)
        rig.until(lambda: bool(rig.status & 0x0400), 2.0)
        assert rig.now - begin == pytest.approx(0.25 + 0.5, abs=0.08)
        assert not rig.status & 0x1000
        rig.write(0x60FF, 0)
        rig.until(lambda: rig.status & 0x1400 == 0x1400, 1.0)

    def test_velocity_is_limited(self, rig: Rig) -> None:
        rig.write(0x607F, 10_000)
        rig.enable(3)
        rig.write(0x60FF, 50_000)
        rig.cycles(500)
        assert mean_velocity(rig) == pytest.approx(10_000, rel=0.02)

    def test_offset_adds_to_the_cyclic_velocity(self, rig: Rig) -> None:
        rig.enable(9)
        rig.write(0x60FF, 10_000)
        rig.write(0x60B1, 5_000)
        rig.cycles(500)
        assert mean_velocity(rig) == pytest.approx(15_000, rel=0.02)


class TestCyclicPosition:
    def test_tracks_a_sine_and_reports_the_following_error(self, rig: Rig) -> None:
        rig.enable(8)
        errors = []
        for k in range(2000):
            target = round(2000 * (1 - math.cos(2 * math.pi * 1.5 * k * 1e-3)))
            rig.write(0x607A, target)
            rig.cycle()
            errors.append(rig.read(0x60F4, signed=True))
        # At reversals, the error is some counts until the integrator supplies the torque.
        assert max(abs(e) for e in errors[200:]) < 60
        assert rig.status & 0x3000 == 0x1000

    def test_interpolates_over_the_period_of_60C2(self, rig: Rig) -> None:
        rig.write(0x60C2, 20, 1)
        rig.enable(8)
        rig.cycles(40)
        start = rig.read(0x6062, signed=True)
        rig.write(0x607A, 200)
        rig.cycle()  # applied at its SYNC
        references = []
        for _ in range(20):
            rig.now += 1e-3
            rig.drive.advance(rig.now)
            references.append(rig.read(0x6062, signed=True) - start)
        assert start == 0
        assert references == pytest.approx([10 * k for k in range(1, 21)], abs=1)

    def test_torque_offset_is_fed_forward(self, rig: Rig) -> None:
        rig.enable(8)
        rig.write(0x60B2, 20)
        rig.cycles(2)
        assert rig.read(0x6074, signed=True) == pytest.approx(20, abs=12)


class TestTorque:
    def test_torque_follows_its_slope_and_reports_the_target(self, rig: Rig) -> None:
        rig.write(0x6087, 1000)
        rig.enable(4)
        rig.torque = 100
        demands = []
        for _ in range(120):
            rig.cycle()
            demands.append(rig.read(0x6074, signed=True))
        ramp = np.array(demands)
        slope = np.polyfit(np.arange(20, 80), ramp[20:80], 1)[0]
        assert slope == pytest.approx(1.0, abs=0.02)
        assert rig.status & 0x0400
        assert ramp[-1] == 100
        assert all(b >= a for a, b in itertools.pairwise(demands))

    def test_torque_acts_from_the_next_sync(self) -> None:
        """A command sent before SYNC k acts during the cycle after it."""
        rig = Rig(SMOOTH)
        rig.enable(10)
        rig.torque = 300
        rig.cycle()
        assert rig.drive.axis.sample[6] == 0.0
        rig.cycle()
        lag = 1 - math.exp(-2 * math.pi * 500 * 1e-3)
        assert rig.drive.axis.sample[6] == pytest.approx(0.9 * 1.04 * lag, rel=1e-3)

    def test_offset_adds_to_the_cyclic_torque(self, rig: Rig) -> None:
        rig.enable(10)
        rig.torque = 10
        rig.write(0x60B2, 12)
        rig.cycles(10)
        assert rig.actual_torque == 22

    @pytest.mark.parametrize(
        ("index", "value", "up", "down"),
        [(0x6072, 50, 50, -50), (0x60E0, 40, 40, -100), (0x60E1, 30, 100, -30)],
    )
    def test_torque_limits_clamp_the_torque(
        self, rig: Rig, index: int, value: int, up: int, down: int
    ) -> None:
        rig.write(index, value)
        rig.enable(10)
        for demand, expected in ((100, up), (-100, down)):
            rig.torque = demand
            rig.cycles(10)
            assert rig.actual_torque == expected
            assert bool(rig.status & 0x0800) == (demand != expected)
            assert bool(rig.status & 0x1000) == (demand == expected)

    def test_peak_current_limits_too(self, rig: Rig) -> None:
        rig.write(0x6073, 1000)
        rig.enable(10)
        rig.torque = 2000
        rig.cycles(5)
        assert rig.actual_torque == pytest.approx(5.59 * 0.561 / 3.0 * 1000, abs=1)
        assert rig.read(0x6078, signed=True) == pytest.approx(1000, abs=1)

    def test_no_mode_gives_no_torque(self, rig: Rig) -> None:
        rig.enable(0)
        rig.torque = 500
        rig.cycles(50)
        assert rig.actual_torque == 0
        assert abs(rig.truth[0]) < 0.02
