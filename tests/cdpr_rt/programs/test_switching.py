"""Programs change without a step, for any sequence of programs and any stream."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.cdpr_rt.programs.program_rig import COUNT_RAD, PERIOD_S, COULOMB_Nm, N, ProgramRig

CYCLE_S = st.integers(1, 150).map(lambda cycles: cycles * PERIOD_S)


def axes(most: float) -> st.SearchStrategy[list[float]]:
    return st.lists(st.floats(-most, most), min_size=N, max_size=N)


orders = st.one_of(
    st.tuples(st.sampled_from(["hold", "idle", "follow"]), st.none()),
    st.tuples(st.just("jog"), st.none() | st.fixed_dictionaries({"velocity_rad_s": axes(30.0)})),
    st.tuples(
        st.just("pid"),
        st.fixed_dictionaries({"position_rad": axes(20.0), "speed_rad_s": st.floats(0.1, 50.0)})
        | st.fixed_dictionaries({"distance_rad": axes(20.0)}),
    ),
    st.tuples(
        st.just("sweep"),
        st.fixed_dictionaries({"distance_rad": axes(1.0), "speed_rad_s": st.floats(0.01, 1.0)}),
    ),
    st.tuples(st.just("again"), st.none()),
    st.tuples(st.just("stop"), st.none()),
)
samples = st.one_of(
    st.none(), st.tuples(st.floats(-20, 20), st.floats(-0.1, 0.1), st.floats(0, 1e-3))
)


def check_set_points(rig: ProgramRig) -> None:
    """Velocity changes within the acceleration, and the position is its integral."""
    position, velocity = rig.array("position"), rig.array("velocity")
    # in idle the set-point follows the axis
    moved = rig.array("program")[1:] != "idle"
    steps = np.abs(np.diff(velocity, axis=0))[moved]
    assert np.all(steps <= rig.model.acceleration_rad_s2 * PERIOD_S * (1 + 1e-9) + 1e-7)
    mean = 0.5 * (velocity[1:] + velocity[:-1]) * PERIOD_S
    np.testing.assert_allclose(np.diff(position, axis=0)[moved], mean[moved], atol=1e-9)
    assert np.all(np.isfinite(rig.array("torque")))
    assert np.all(np.abs(rig.array("torque")) <= rig.model.torque_Nm)


@settings(max_examples=40)
@given(st.lists(st.tuples(orders, CYCLE_S, samples), min_size=1, max_size=10))
def test_no_sequence_of_programs_causes_a_step_in_velocity(
    sequence: list[tuple[tuple[str, dict[str, object] | None], float, tuple[float, ...] | None]],
) -> None:
    rig = ProgramRig()
    for (name, wanted), seconds, sample in sequence:
        if name == "stop":
            rig.program.stop()
        elif name == "again":
            rig.switch(rig.program.name)
        else:
            rig.switch(name, wanted)
        for _ in range(round(seconds / PERIOD_S)):
            if sample is not None and rig.feedback.cycle % 30 == 0:
                rig.send(sample[:3], scale=5.0)
            rig.cycle()
    check_set_points(rig)


@settings(max_examples=20)
@given(
    st.lists(st.floats(0.0, 0.05), min_size=40, max_size=40),
    st.sets(st.integers(0, 39), max_size=12),
    st.lists(st.tuples(st.floats(-0.1, 0.1), st.floats(-1, 1)), min_size=40, max_size=40),
)
def test_no_stream_causes_a_step_in_velocity(
    transits: list[float], dropped: set[int], shakes: list[tuple[float, float]]
) -> None:
    """The hand shakes and leaps; packets are lost, late, doubled and reordered."""
    rig = ProgramRig()
    rig.switch("hold")
    rig.run(0.05)
    rig.switch("follow")
    start = rig.feedback.cycle
    arrivals = [
        (k / 30.0 + transit + again, k)
        for k, transit in enumerate(transits)
        if k not in dropped
        for again in ([0.0, 0.02] if k % 3 == 0 else [0.0])
    ]
    sample = rig.sample
    sample["scale"] = 1.0
    for arrives_s, k in sorted(arrivals):
        while (rig.feedback.cycle - start) * PERIOD_S < arrives_s:
            rig.cycle()
        sample["sequence"], sample["sent_ns"] = k, round(1e9 * k / 30.0)
        hand = 0.2 * np.sin(k / 5.0)
        sample["position_m"] = (hand + shakes[k][0], hand + shakes[k][1], 0.0)
        rig.block.post_sample(sample)
    rig.run(1.5)
    check_set_points(rig)
    assert rig.program.at_rest
    held = rig.array("program") == "follow"
    assert np.ptp(rig.array("position")[held][:, 0]) > 1.0


NAMES = tuple(ProgramRig().programs)


@pytest.mark.parametrize("first", NAMES)
@pytest.mark.parametrize("second", NAMES)
def test_a_program_begins_with_the_torque_of_the_previous_one(first: str, second: str) -> None:
    wanted = {
        "jog": {"velocity_rad_s": [5.0] * N},
        "pid": {"distance_rad": [-3.0] * N},
        "sweep": {"distance_rad": [1.0] * N},
    }
    rig, unchanged = ProgramRig(), ProgramRig()
    for each in (rig, unchanged):
        each.switch("hold")
        each.run(0.1)
        each.switch(first, wanted.get(first))
        each.run(0.06)
    last = rig.torque.copy()
    rig.switch(second, wanted.get(second))
    rig.cycle()
    unchanged.cycle()
    shared = rig.programs["hold"].controller
    if all(rig.programs[name].controller is shared for name in (first, second)):
        # the same controller continues; the difference is the first cycle of a new motion and the
        # known friction of the last axis
        gains = rig.model.gains[0]
        share = rig.model.acceleration_rad_s2 * PERIOD_S**2
        stiffness = gains.proportional_Nm_rad + gains.derivative_Nms_rad / PERIOD_S
        most = stiffness * share + [0.0, 0.0, COULOMB_Nm]
        assert np.all(np.abs(rig.torque - unchanged.torque) <= most)
    else:
        np.testing.assert_allclose(rig.torque, last, atol=1e-12)


def test_a_load_is_held_through_changes_of_program() -> None:
    rig = ProgramRig(load_Nm=(0.4, -0.3, 0.0))
    rig.switch("hold")
    rig.run(5.0)
    for name in ("jog", "pid", "hold", "follow", "hold", "pid"):
        rig.switch(name)
        rig.run(0.2)
    settled = rig.array("angle")[-1200:]
    # no motion beyond the encoder's noise
    assert np.all(np.ptp(settled, axis=0) <= 20 * COUNT_RAD)
