"""Loads on the cable: statics, energy, slack, floor, brake, and safe torque off."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cdpr_profiles.errors import ProfileError
from cdpr_sim_bus.physics_board import PhysicsBoard
from cdpr_sim_bus.robot import servo
from cdpr_sim_bus.robot.motor_state import Transmission
from cdpr_sim_bus.robot.plant import Plant
from tests.sim_bus.cia402.drive_rig import Rig
from tests.sim_bus.robot.bare_motor import Motor
from tests.sim_bus.robot.plant_torques import friction_Nm

GAIN = 0.026
G = 9.80665
COLD = {"cogging_per_K": 0.0, "friction_per_K": 0.0}
FREE = {"coulomb_Nm": 0.0, "breakaway_Nm": 0.0, "viscous_Nms_rad": 0.0, "sigma1_Nms_rad": 0.0}


def plant(load: dict[str, Any], **sections: Any) -> Plant:
    fine = {"counts_per_turn": 65536, "noise_counts": 0.0}
    exact = {"torque_constant_error": 0.0}
    rest = {"thermal": COLD, "cogging": (), "encoder": fine, "motor": exact, "load": load}
    return Plant.model_validate(rest | sections)


def read(motor: Motor, field: str) -> float:
    return float(motor.record[field][0])


def hold(motor: Motor, torque_Nm: float, seconds: float, target: float | None = None) -> None:
    """Apply a torque, or with `target` a velocity in counts/s."""
    for _ in range(round(seconds / 1e-3)):
        if target is None:
            motor.step(1e-3, servo.TORQUE, torque_Nm / 3.0 * 1e3)
        else:
            motor.step(1e-3, servo.VELOCITY, target)


def torque_at(motor: Motor, rad_s: float) -> float:
    """Return the mean torque over a motor turn at constant velocity."""
    counts_s = rad_s * read(motor, "counts_per_rad")
    hold(motor, 0.0, 1.5, counts_s)
    sums, steps = 0.0, round(math.tau / abs(rad_s) / 1e-3)
    for _ in range(steps):
        sums += motor.step(1e-3, servo.VELOCITY, counts_s).motor_Nm
    return sums / steps


@pytest.mark.parametrize("sign", [1, -1])
@pytest.mark.parametrize("mass_kg", [2.0, 8.0])
def test_torque_to_raise_or_lower_a_mass_is_weight_plus_or_minus_friction(
    sign: int, mass_kg: float
) -> None:
    load = {"kind": "hung_mass", "mass_kg": mass_kg, "height_m": 1.0, "friction_share": 0.06}
    load |= {"winch_friction_Nm": 0.03, "drum_radius_error": 0.02}
    p = plant(load)
    motor = Motor(p, transmission=Transmission(sign * GAIN))
    winding_in = -sign * 2.0
    up, down = torque_at(motor, winding_in), torque_at(motor, -winding_in)
    weight = mass_kg * G * GAIN * 1.02
    friction = 0.03 + 0.06 * weight + friction_Nm(p, [2.0, -2.0]) * [1, -1]
    first, second = friction if winding_in > 0 else friction[::-1]
    assert -sign * up == pytest.approx(weight + first, rel=2e-3)
    assert -sign * down == pytest.approx(weight - second, rel=2e-3)
    assert read(motor, "tension") == pytest.approx(mass_kg * G, rel=2e-2)


def test_energy_is_conserved_apart_from_friction_and_cable_damping() -> None:
    load = {"kind": "hung_mass", "mass_kg": 4.0, "height_m": 2.0, "cable_damping_s": 0.0}
    load |= {"friction_share": 0.0, "cable_m": 40.0}
    p = plant(load, friction=FREE)
    motor = Motor(p, transmission=Transmission(GAIN))
    k, J, m = 1000.0, p.inertia_kg_m2, 4.0

    def energy() -> float:
        y, v = read(motor, "mass_position"), read(motor, "mass_velocity")
        stretch = read(motor, "tension") / k
        kinetic = 0.5 * J * read(motor, "velocity") ** 2 + 0.5 * m * v * v
        return kinetic + 0.5 * k * stretch**2 - m * G * y

    start, angle, put_in, lost = energy(), 0.0, 0.0, 0.0
    before = np.array([4.0 * G / k, 0.0, 0.0])
    for step in range(6000):  # at each control step, so that the work is exact
        torque = -4.0 * G * GAIN * (1.3 + math.sin(step * 0.01))
        sample = motor.step(5e-5, servo.TORQUE, torque / 3.0 * 1e3)
        put_in += sample.motor_Nm * (sample.angle_rad - angle)
        angle = sample.angle_rad
        stretch = read(motor, "tension") / k
        now = np.array([stretch, read(motor, "velocity"), read(motor, "mass_velocity")])
        lost += 0.5 * np.array([k, J, m]) @ (now - before) ** 2  # dissipation of implicit Euler
        before = now
    assert put_in > 1.0
    assert lost < 0.02 * put_in
    assert energy() - start == pytest.approx(put_in - lost, rel=1e-4)


@settings(max_examples=15)
@given(
    stiffness=st.floats(1e3, 1e9),
    damping=st.floats(0.0, 0.1),
    tension=st.floats(5.0, 90.0),
    error=st.floats(-0.1, 0.1),
)
def test_tension_of_an_anchored_cable_balances_the_torque_within_friction(
    stiffness: float, damping: float, tension: float, error: float
) -> None:
    load = {"kind": "fixed_anchor", "cable_stiffness_N": stiffness, "cable_damping_s": damping}
    load |= {"drum_radius_error": error, "friction_share": 0.1}
    p = plant(load)
    motor = Motor(p, transmission=Transmission(GAIN))
    for share in np.linspace(0.0, 1.0, 400):
        hold(motor, -tension * GAIN * share, 1e-3)
    hold(motor, -tension * GAIN, 0.6)
    gain = GAIN * (1.0 + error)
    band = 0.1 * 1.05 + 0.1 * tension * gain
    assert abs(read(motor, "velocity")) < 0.1
    assert abs(read(motor, "tension") * gain - tension * GAIN) < band
    assert read(motor, "tension") > 0.0 or tension * GAIN < band
    hold(motor, 0.5, 0.3)
    assert read(motor, "tension") == 0.0


def test_a_slack_cable_has_no_tension_until_it_lifts_the_mass() -> None:
    load = {"kind": "hung_mass", "mass_kg": 3.0, "slack_m": 0.05}
    motor = Motor(plant(load), transmission=Transmission(GAIN))
    seen = []
    counts_s = -1.0 * read(motor, "counts_per_rad")
    for _ in range(4000):
        motor.step(1e-3, servo.VELOCITY, counts_s)
        seen.append((read(motor, "angle"), read(motor, "tension"), read(motor, "mass_position")))
    for angle, tension, position in seen:
        if -angle * GAIN < 0.0499:
            assert tension == 0.0
            assert position == pytest.approx(0.0, abs=1e-12)
    angle, tension, position = seen[-1]
    assert tension == pytest.approx(3.0 * G, rel=0.1)
    assert position == pytest.approx(angle * GAIN + 0.05 + tension / 13333, abs=5e-4)
    assert position < -0.04


def test_brake_holds_a_mass_that_falls_without_it() -> None:
    load = {"kind": "hung_mass", "mass_kg": 10.0, "height_m": 0.3}
    motor = Motor(plant(load), transmission=Transmission(GAIN))
    motor.record["brake"] = 8.0
    for _ in range(500):
        motor.step(1e-3, servo.OFF, 0.0)
    assert read(motor, "angle") == 0.0
    assert read(motor, "tension") == pytest.approx(98.07, rel=1e-3)
    motor.record["brake"] = 0.0
    for _ in range(2000):
        motor.step(1e-3, servo.OFF, 0.0)
    assert read(motor, "mass_position") == pytest.approx(0.3, abs=1e-6)  # on the floor
    assert read(motor, "tension") == 0.0
    assert read(motor, "angle") * GAIN > 0.3


def enabled(tmp_path: Path, load: dict[str, Any] | None = None) -> tuple[Rig, PhysicsBoard]:
    rig = Rig(plant(load or {}))
    board = PhysicsBoard.create(tmp_path / "board", 1)
    rig.drive.connect(board.axis(0))
    rig.write(0x6060, 4)
    rig.run(0.02)
    for word in (0x06, 0x07, 0x0F):
        rig.write(0x6040, word)
        rig.run(0.01)
    assert rig.read(0x6041) & 0x6F == 0x27
    return rig, board


def test_safe_torque_off_removes_torque_and_faults_an_enabled_drive(tmp_path: Path) -> None:
    rig, board = enabled(tmp_path)
    axis = board.axis(0)
    rig.write(0x6071, 300)
    rig.run(0.05)
    state = axis.state()
    assert state.power_on and state.motor_rad_s > 10.0
    assert state.motor_rad == pytest.approx(rig.drive.axis.sample[4])
    axis.power_allowed = False
    rig.run(0.005)
    assert not axis.state().power_on
    assert abs(rig.drive.axis.sample[6]) < 1e-6
    word = rig.read(0x6041)
    assert word & 0x4F == 0x08 and not word & 0x10  # fault, without voltage
    assert rig.emergencies[-1][0] == 0x5441
    rig.write(0x6040, 0x80)
    for command in (0x06, 0x07, 0x0F):  # only after power is allowed again
        rig.write(0x6040, command)
        rig.run(0.01)
    assert rig.read(0x6041) & 0x5F == 0x40
    axis.power_allowed = True
    for command in (0x06, 0x07, 0x0F):
        rig.write(0x6040, command)
        rig.run(0.01)
    assert rig.read(0x6041) & 0x7F == 0x37
    board.close()


def test_safe_torque_off_disables_a_switched_on_drive_without_a_fault(tmp_path: Path) -> None:
    rig, board = enabled(tmp_path)
    rig.write(0x6040, 0x07)
    rig.run(0.1)
    board.axis(0).power_allowed = False
    rig.run(0.01)
    assert rig.read(0x6041) & 0x5F == 0x40
    assert not rig.emergencies
    board.close()


def test_board_brake_and_mass_reach_the_motor(tmp_path: Path) -> None:
    rig, board = enabled(tmp_path, {"kind": "hung_mass", "mass_kg": 2.0, "height_m": 50.0})
    axis = board.axis(0)
    assert axis.hung_mass_kg == 2.0
    axis.hung_mass_kg = 6.0
    axis.brake_released = False
    rig.write(0x6040, 0x00)
    rig.run(6.0)
    still = axis.state()
    assert still.tension_N == pytest.approx(6.0 * G, rel=1e-2)
    assert still.motor_rad_s == 0.0
    axis.brake_released = True
    rig.run(0.3)
    assert axis.state().motor_rad_s > 1.0
    board.close()


def test_a_contradictory_plant_is_rejected(tmp_path: Path) -> None:
    path = tmp_path / "plant.toml"
    for text, named in (
        ("[load]\nkind = 'spring'", "load.kind"),
        ("[load]\nmas_kg = 3.0", "mass_kg"),
        ("[load]\nslack_m = 0.1\npretension_N = 5.0", "slack_m"),
        ("[motor]\nbrake_torque_Nm = 0.0", "brake_torque_Nm"),
    ):
        path.write_text(text)
        with pytest.raises(ProfileError, match=named):
            Plant.load_file(path)


def test_scheduled_loss_of_power_on_the_board_acts_at_its_bus_time(tmp_path: Path) -> None:
    rig, board = enabled(tmp_path)
    drive, axis = rig.drive, board.axis(0)
    begun_s = drive.axis.time
    # the second time differs from the drive's only by rounding
    for until_s in (begun_s + 0.0105, begun_s + 0.0105 + 1e-13):
        axis.allow_power((-math.inf, until_s))
        while drive.axis.time < until_s - 1e-9:
            assert drive.state_machine.power_allowed
            drive.advance(drive.next_event())
        drive.advance(until_s)
        assert not drive.state_machine.power_allowed
        assert drive.axis.time == pytest.approx(until_s, abs=1e-9)
        assert drive.next_event() > until_s + 1e-6
    board.close()
