"""The behaviour of each program for its requests."""

import json
import tracemalloc

import numpy as np
import pytest

from cdpr_rt.programs.base import ProgramError
from tests.cdpr_rt.programs.program_rig import PERIOD_S, COULOMB_Nm, N, ProgramRig


def test_programs_are_in_the_order_of_their_numbers() -> None:
    assert list(ProgramRig().programs) == ["idle", "hold", "jog", "sweep", "pid", "follow"]


def test_idle_fades_the_torque_and_the_set_point_follows_the_axes() -> None:
    rig = ProgramRig()
    rig.switch("hold")
    rig.run(0.5)
    held = rig.torque.copy()
    assert abs(held[1]) > 0.1
    rig.switch("idle")
    assert not rig.program.at_rest
    rig.run(0.3)
    steps = np.abs(np.diff(rig.array("torque")[-301:], axis=0))
    assert np.all(steps <= np.abs(held) * PERIOD_S / 0.2 + 1e-12)
    assert np.all(rig.torque == 0.0)
    assert rig.program.at_rest
    assert rig.speed[1] > 1.0  # the load turns it
    np.testing.assert_array_equal(rig.setpoint.position_rad, rig.feedback.position_rad)
    assert rig.setpoint.velocity_rad_s[1] == pytest.approx(rig.speed[1], rel=0.3)


def test_hold_stops_a_turning_axis_and_keeps_it_there() -> None:
    rig = ProgramRig()
    rig.run(0.02)
    assert rig.speed[1] > 5.0
    rig.switch("hold")
    rig.run(4.0)
    assert rig.program.at_rest
    place = rig.setpoint.position_rad.copy()
    rig.run(0.5)
    np.testing.assert_array_equal(rig.setpoint.position_rad, place)
    # the integral part brings axes back against the load
    np.testing.assert_allclose(rig.angle, place, atol=0.01)
    np.testing.assert_allclose(rig.torque, -rig.load_Nm, atol=1.2 * COULOMB_Nm)


def test_jog_stops_when_its_request_is_not_repeated_in_time() -> None:
    rig = ProgramRig()
    rig.switch("hold")
    rig.run(0.1)
    rig.switch("jog")
    wanted = {"velocity_rad_s": [5.0, -4.0, 0.0], "timeout_s": 0.2}
    for _ in range(10):
        rig.program.command(wanted)
        rig.run(0.15)
        assert not rig.program.at_rest
    np.testing.assert_array_equal(rig.setpoint.velocity_rad_s, [5.0, -4.0, 0.0])
    np.testing.assert_allclose(rig.speed, [5.0, -4.0, 0.0], atol=0.5)
    assert rig.program.progress()["left_s"] == pytest.approx(0.05)
    rig.run(0.05)
    np.testing.assert_array_equal(rig.setpoint.velocity_rad_s, [5.0, -4.0, 0.0])
    rig.run(0.1)
    np.testing.assert_array_equal(rig.setpoint.velocity_rad_s, 0.0)
    assert rig.program.at_rest


def test_jog_takes_velocities_of_cables() -> None:
    rig = ProgramRig()
    rig.switch("jog", {"cable_velocity_m_s": [0.026, 0.026, -0.1]})
    rig.run(0.4)
    np.testing.assert_allclose(rig.setpoint.velocity_rad_s, [1.0, -1.0, -2.0])


def test_pid_moves_axes_together_and_reports_its_progress() -> None:
    rig = ProgramRig()
    rig.switch("hold")
    rig.run(0.1)
    rig.switch("pid")
    rig.run(0.5)
    start = rig.setpoint.position_rad.copy()
    rig.program.command({"distance_rad": [10.0, -2.0, None]})
    rig.run(0.3)
    way = rig.setpoint.position_rad - start
    assert 0.0 < way[0] < 10.0
    assert way[1] == pytest.approx(-0.2 * way[0], rel=1e-6)
    assert way[2] == 0.0
    assert rig.program.progress()["done"] == pytest.approx(way[0] / 10.0)
    assert not rig.program.at_rest
    rig.run(0.9)
    assert rig.program.at_rest
    assert rig.program.progress()["done"] == 1.0
    np.testing.assert_allclose(
        rig.setpoint.position_rad, start + np.array([10.0, -2.0, 0.0]), atol=1e-9
    )
    rig.run(1.0)
    np.testing.assert_allclose(rig.angle, rig.setpoint.position_rad, atol=0.02)


def test_pid_takes_positions_cable_lengths_and_a_lower_speed() -> None:
    rig = ProgramRig()
    rig.switch("pid", {"position_rad": [1.0, 2.0, 3.0], "speed_rad_s": 2.0})
    rig.run(1.0)
    assert np.max(np.abs(rig.setpoint.velocity_rad_s)) == pytest.approx(2.0)
    rig.run(1.0)
    np.testing.assert_array_equal(rig.setpoint.position_rad, [1.0, 2.0, 3.0])
    rig.program.command({"cable_m": [0.026, 0.026, None]})
    rig.run(1.0)
    np.testing.assert_allclose(rig.setpoint.position_rad, [2.0, 1.0, 3.0])
    # a moving axis with a distance of 0 brakes immediately
    rig.program.command({"position_rad": [50.0, 1.0, 3.0]})
    rig.run(0.3)
    there = rig.setpoint.position_rad[0] + rig.setpoint.velocity_rad_s[0] ** 2 / 160.0
    rig.program.command({"distance_rad": [None, 0.0, 0.0]})
    rig.run(1.0)
    assert rig.setpoint.position_rad[0] == pytest.approx(there)
    assert np.max(rig.array("position")[:, 0]) <= there + 0.01


@pytest.mark.parametrize("name", ["pid", "sweep"])
def test_a_denormal_distance_is_reached_without_overflow(name: str) -> None:
    rig = ProgramRig((0.0, 0.0, 0.0))
    with np.errstate(over="raise", divide="raise", invalid="raise"):
        rig.switch(name, {"distance_rad": [5e-324, 0.0, -1e-310]})
        rig.run(0.05)
    assert rig.program.progress()["done"] == 1.0
    assert np.isfinite(rig.setpoint.position_rad).all()


def test_sweep_moves_back_and_forth_at_constant_speed() -> None:
    rig = ProgramRig(load_Nm=(0.0, 0.0, 0.0))
    rig.switch("hold")
    rig.run(0.05)
    rig.switch("sweep", {"distance_rad": [0.5, -0.5, 0.0], "speed_rad_s": 1.0, "legs": 3})
    start = rig.setpoint.position_rad.copy()
    rig.run(0.3)
    np.testing.assert_allclose(rig.setpoint.velocity_rad_s, [1.0, -1.0, 0.0], atol=1e-12)
    assert rig.program.progress() == {"leg": 1, "legs": 3, "done": pytest.approx(0.59, abs=0.03)}
    rig.run(1.7)
    assert rig.program.at_rest
    assert rig.program.progress()["leg"] == 3
    np.testing.assert_allclose(
        rig.setpoint.position_rad, start + np.array([0.5, -0.5, 0.0]), atol=1e-9
    )
    turns = np.flatnonzero(np.diff(np.sign(rig.array("velocity")[50:, 0])) != 0)
    assert turns.size == 6  # start, rest and reversal at either end, and rest
    # the controller has no integral: a steady lag of friction over gain
    gain = rig.model.sweep_gain_Nm_rad[0]
    lag = rig.array("position")[300, 0] - rig.array("angle")[300, 0]
    assert lag == pytest.approx(COULOMB_Nm / gain, rel=0.3)


def test_follow_pays_out_cable_as_the_hand_moves() -> None:
    rig = ProgramRig()
    rig.switch("hold")
    rig.run(0.3)
    rig.switch("follow")
    start = rig.setpoint.position_rad.copy()
    rig.sample["buttons"] = 0x201
    for k in range(60):
        t = k / 30.0
        rig.send((7.0 + 0.05 * t, -3.0, 0.04 * t), scale=2.0)
        rig.run(1 / 30.0)
    assert rig.program.progress()["stream"] == "fresh"
    assert rig.program.stream_age_s == pytest.approx(0.033, abs=0.002)
    assert rig.program.stream_buttons == 0x201
    rig.run(0.3)
    way = rig.setpoint.position_rad - start
    np.testing.assert_allclose(
        way * rig.model.cable_m_per_rad, [2.0 * 0.05 * 59 / 30, 0.0, 2.0 * 0.04 * 59 / 30]
    )
    assert not rig.program.at_rest
    rig.run(0.6)
    assert rig.program.at_rest
    assert rig.program.progress()["stream"] == "stopped"
    # a hand that returns elsewhere moves nothing
    rig.send((1.0, 1.0, 1.0))
    rig.run(0.4)
    np.testing.assert_allclose(rig.setpoint.position_rad, start + way)


def test_a_stream_that_begins_immediately_starts_where_the_axes_are() -> None:
    """Not at the target that an earlier stream has left."""
    rig = ProgramRig()
    rig.switch("follow")
    for k in range(30):
        rig.send((0.01 * k, 0.0, 0.0))
        rig.run(1 / 30.0)
    rig.switch("jog", {"velocity_rad_s": [-5.0, 0.0, 0.0], "timeout_s": 1.0})
    rig.run(0.8)
    turning = rig.setpoint.position_rad.copy()
    rig.switch("follow")
    rig.send((0.0, 0.0, 0.0))
    rig.run(0.4)
    way = rig.setpoint.position_rad - turning
    # it has only braked
    assert way[0] == pytest.approx(-(5.0**2) / 160.0, rel=0.01)
    np.testing.assert_array_equal(way[1:], 0.0)


def test_an_axis_slower_than_the_hand_stops_soon_after_the_stream() -> None:
    rig = ProgramRig()
    rig.switch("follow")
    for k in range(30):
        rig.send((5.0 * k / 30.0, 0.0, 0.0))
        rig.run(1 / 30.0)
    assert np.max(rig.array("velocity")) <= 40.0
    before = rig.setpoint.position_rad[0]
    rig.run(1.0)
    assert rig.program.at_rest
    place = rig.setpoint.position_rad[0]
    assert 0.0 < place - before < 40.0 * (0.3 + 0.1 + 40.0 / 160.0)
    # the rest of the way is not made up for later
    rig.send((0.0, 0.0, 0.0))
    rig.run(0.4)
    assert rig.setpoint.position_rad[0] == place


@pytest.mark.parametrize("name", ["hold", "jog", "sweep", "pid", "follow"])
def test_a_stopped_program_brakes_and_rejects_further_requests(name: str) -> None:
    rig = ProgramRig()
    rig.switch("jog", {"velocity_rad_s": [20.0, -20.0, 20.0]})
    rig.run(0.45)
    wanted = {"sweep": {"distance_rad": [9.0] * N}, "pid": {"distance_rad": [90.0] * N}}
    rig.switch(name, wanted.get(name))
    rig.run(0.05)
    rig.program.stop()
    assert not rig.program.at_rest
    for _ in range(1000):
        rig.cycle()
        if rig.program.at_rest:
            break
    assert rig.program.at_rest
    np.testing.assert_array_equal(rig.setpoint.velocity_rad_s, 0.0)
    orders = {"jog": {"velocity_rad_s": [0.0] * N}, **wanted}
    with pytest.raises(ProgramError, match=f"{name}: the program is stopping"):
        rig.program.command(orders.get(name, {}))


NAN, INF = float("nan"), float("inf")


@pytest.mark.parametrize(
    ("name", "wanted", "message"),
    [
        ("idle", {"x": 1}, r"idle: key 'x'; allowed: none"),
        ("hold", {"position_rad": [0.0]}, r"hold: key 'position_rad'; allowed: none"),
        ("jog", {}, r"jog: no argument; allowed: one of velocity_rad_s, cable_velocity_m_s"),
        ("jog", {"velocity_rad_s": [0.0] * N, "cable_velocity_m_s": [0.0] * N}, r"one of"),
        ("jog", {"velocity_rad_s": 1.0}, r"value 1.0; allowed: a list of 3, one number an axis"),
        ("jog", {"velocity_rad_s": "abc"}, r"value 'abc'; allowed: a list of 3"),
        ("jog", {"velocity_rad_s": [1.0, 1.0]}, r"allowed: a list of 3, one number an axis"),
        ("jog", {"velocity_rad_s": [1.0, NAN, 1.0]}, r"velocity_rad_s\[1\]: value nan"),
        ("jog", {"velocity_rad_s": [1.0, 1.0, INF]}, r"\[2\]: value inf; allowed: .* -50 to 50"),
        ("jog", {"velocity_rad_s": [41.0, 1.0, 1.0]}, r"\[0\]: value 41.0; .* -40 to 40"),
        ("jog", {"velocity_rad_s": [None, 1.0, 1.0]}, r"\[0\]: value None; allowed: a number"),
        ("jog", {"velocity_rad_s": [True, 1.0, 1.0]}, r"\[0\]: value True; allowed: a number"),
        ("jog", {"cable_velocity_m_s": [1.5, 0.0, 0.0]}, r"\[0\]: value 1.5; .* -1.04 to 1.04"),
        (
            "jog",
            {"velocity_rad_s": [0.0] * N, "timeout_s": 3},
            r"timeout_s: value 3; .* 0.001 to 2",
        ),
        ("jog", {"velocity_rad_s": [10**400] * N}, r"\[0\]: value 1000.* \.\.\.; allowed"),
        ("pid", {"position_rad": [1e5, 0.0, 0.0]}, r"\[0\]: value 100000.0; .* -10000 to 10000"),
        ("pid", {"cable_m": [0.0, 261.0, 0.0]}, r"cable_m\[1\]: value 261.0; .* -260 to 260"),
        ("pid", {"distance_rad": [0.0] * N, "speed_rad_s": 0}, r"speed_rad_s: value 0; allowed"),
        ("pid", {"distance_rad": [0.0] * N, "speed_rad_s": "x"}, r"speed_rad_s: value 'x'"),
        ("sweep", {}, r"distance_rad: value None; allowed: a list of 3"),
        ("sweep", {"distance_rad": [0.0] * N, "legs": 1.5}, r"legs: value 1.5; allowed: a whole"),
        ("sweep", {"distance_rad": [0.0] * N, "legs": 0}, r"legs: value 0; allowed"),
        ("sweep", {"distance_rad": [0.0] * N, "speed_rad_s": 9.0}, r"speed_rad_s: value 9.0"),
        ("follow", {"scale": 2.0}, r"follow: key 'scale'; allowed: none"),
    ],
)
def test_unsupported_requests_are_rejected_and_change_nothing(
    name: str, wanted: dict[str, object], message: str
) -> None:
    rig = ProgramRig()
    good = {"jog": {"velocity_rad_s": [3.0] * N}, "pid": {"distance_rad": [9.0] * N}}
    good["sweep"] = {"distance_rad": [1.0] * N}
    rig.switch(name, good.get(name))
    rig.run(0.1)
    progress = json.dumps(rig.program.progress(), allow_nan=False)
    with pytest.raises(ProgramError, match=message):
        rig.program.check(wanted)
    with pytest.raises(ProgramError, match=message):
        rig.program.command(wanted)
    assert json.dumps(rig.program.progress()) == progress


def test_updates_retain_no_memory() -> None:
    rig = ProgramRig()
    orders = {
        "idle": None,
        "hold": None,
        "jog": {"velocity_rad_s": [1.0] * N, "timeout_s": 2.0},
        "sweep": {"distance_rad": [0.01] * N, "legs": 1000},
        "pid": {"distance_rad": [100.0] * N},
        "follow": None,
    }

    def run(cycles: int) -> None:
        for name, wanted in orders.items():
            program = rig.switch(name, wanted)
            for _ in range(cycles):
                rig.feedback.cycle += 1
                program.update(rig.feedback, rig.setpoint, rig.torque)

    run(10)
    tracemalloc.start()
    try:
        run(10)
        before, _ = tracemalloc.get_traced_memory()
        run(2000)
        after, _ = tracemalloc.get_traced_memory()
    finally:
        tracemalloc.stop()
    assert after - before < 2000
