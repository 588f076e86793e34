"""When a cable counts as tight as its slack is taken up, and how hard its winch may pull."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
import pytest

from cdpr_rt.arrays import FloatArray, IntArray
from cdpr_rt.control.winch_speed_loop import WinchSpeedLoop
from cdpr_rt.core.exchange import AxisFeedback
from cdpr_rt.programs import slack as kernel
from cdpr_rt.programs.slack import Stillness

PERIOD_S, CABLE_m, ENOUGH_N, HARMLESS_N, PRETENSION_N = 1e-3, 0.026, 16.0, 7.0, 60.0
STANDS_N = 8.0


def one(value: float) -> FloatArray:
    return np.full(1, value)


@dataclass
class OneCable:
    """A single cable whose winch turns and pulls as a test says."""

    phase: IntArray = field(default_factory=lambda: np.zeros(1, np.int64))
    state: FloatArray = field(default_factory=lambda: np.zeros((1, kernel.STATE)))
    position: FloatArray = field(default_factory=lambda: one(0.0))
    winch: kernel.Winches = field(
        default_factory=lambda: kernel.Winches(
            PERIOD_S,
            False,
            one(CABLE_m),
            one(ENOUGH_N),
            one(HARMLESS_N),
            one(STANDS_N),
            *(one(0.0) for _ in range(6)),
        )
    )

    def enter(self, phase: int) -> None:
        kernel.enter(phase, self.phase, self.state, self.position)

    def run(self, seconds: float, tension_N: float, inwards_m_s: float = 0.0) -> int:
        """Turn at a speed and tension until the phase changes or time is over; return the phase."""
        before = self.phase[0]
        self.winch.tension_N[0] = tension_N
        self.winch.speed_rad_s[0] = -inwards_m_s / CABLE_m
        for _ in range(round(seconds / PERIOD_S)):
            self.position -= PERIOD_S * inwards_m_s / CABLE_m
            self.winch.high_N[:] = self.winch.low_N[:] = 0.0
            kernel.take_up(
                self.winch, self.phase, self.state, self.position, one(PRETENSION_N), 1.0
            )
            if self.phase[0] != before:
                break
        return int(self.phase[0])


def reeled_in(by_m: float, tension_N: float = 3.0) -> OneCable:
    """Return a cable that was reeled in by a length with a tension after it was paid out."""
    cable = OneCable()
    cable.enter(kernel.LOOSENED)
    assert cable.run(0.5, -3.0, -0.05) == kernel.NEXT
    assert cable.run(0.5, 0.0) == kernel.REELED_IN
    cable.run(0.25, tension_N)
    cable.run((by_m + 0.005) / 0.05, tension_N, 0.05)
    assert cable.phase[0] == kernel.REELED_IN
    return cable


def test_a_cable_is_tight_if_the_tension_that_turned_its_winch_no_longer_does() -> None:
    assert reeled_in(0.03, 9.0).run(0.5, 8.0) == kernel.REELED_IN
    assert reeled_in(0.03, 9.0).run(0.5, 9.0) == kernel.PAID_OUT


def test_a_cable_is_not_tight_below_the_tension_that_any_stand_holds() -> None:
    """Cogging alone may have turned its winch."""
    assert reeled_in(0.03, 1.0).run(0.5, 0.9 * HARMLESS_N) == kernel.REELED_IN
    assert reeled_in(0.03, 1.0).run(0.5, HARMLESS_N) == kernel.PAID_OUT


def test_a_cable_is_not_tight_while_it_is_longer_than_before() -> None:
    """Unless it sticks although the tension exceeds the friction of winches."""
    assert reeled_in(-0.004, 9.0).run(0.5, 12.0) == kernel.REELED_IN
    assert reeled_in(-0.004, 9.0).run(0.5, ENOUGH_N) == kernel.PAID_OUT


def test_a_cable_left_with_slack_is_tight_only_after_reeling_in_again() -> None:
    cable = reeled_in(0.03, 9.0)
    cable.enter(kernel.CLOSING)
    assert cable.run(0.5, 12.0) == kernel.CLOSING
    cable.run(0.08, 9.0, 0.05)
    assert cable.run(0.5, 9.0) == kernel.TIGHT
    assert cable.winch.high_N[0] == cable.state[0, kernel.TIGHT_N] == pytest.approx(9.0)


def test_a_winch_may_pull_harder_only_while_it_stands_still() -> None:
    cable = reeled_in(0.02, 5.0)
    may_N = cable.winch.high_N[0]
    assert 4.0 < may_N < 6.0
    cable.run(0.2, may_N, 0.05)
    assert cable.winch.high_N[0] == may_N
    cable.run(0.03, may_N)
    assert may_N < cable.winch.high_N[0] < may_N + 2.5 * 0.03 * ENOUGH_N


def test_a_winch_that_drags_the_platform_does_not_pull_harder() -> None:
    """Nor does the tension that dragged the platform count as the one needed without load."""
    cable = reeled_in(0.02, 1.0)
    cable.winch.stands_N[0] = 2.0
    for _ in range(20):
        cable.run(0.1, cable.winch.high_N[0])
        cable.run(0.02, cable.winch.high_N[0], 0.05)
    most_N = HARMLESS_N + 2.0
    assert cable.winch.high_N[0] <= most_N
    for _ in range(3):  # nor when it is reeled in again
        cable.enter(kernel.CLOSING)
        cable.run(0.02, 1.0, 0.05)
        for _ in range(20):
            cable.run(0.1, cable.winch.high_N[0])
            cable.run(0.02, cable.winch.high_N[0], 0.05)
        assert cable.winch.high_N[0] <= most_N


def test_a_heavy_cable_does_not_run_out_when_its_turn_begins() -> None:
    cable = OneCable()
    hangs_N = 3.0 * ENOUGH_N
    cable.winch.hangs_N[:] = hangs_N
    cable.enter(kernel.NEXT)
    assert cable.run(0.002, hangs_N) == kernel.REELED_IN
    assert 0.85 * hangs_N < cable.winch.high_N[0] < 0.95 * hangs_N


def test_a_tight_cable_is_released_immediately() -> None:
    cable = reeled_in(0.03, 9.0)
    assert cable.winch.high_N[0] > 0.0
    assert cable.run(0.5, 9.0) == kernel.PAID_OUT
    assert cable.winch.high_N[0] == 0.0


def test_a_cable_is_not_tight_below_the_tension_of_its_weight() -> None:
    cable = reeled_in(0.03, 9.0)
    cable.winch.hangs_N[:] = 40.0
    assert cable.run(0.5, 1.1 * ENOUGH_N) == kernel.REELED_IN
    assert cable.run(0.5, 40.0) == kernel.PAID_OUT


def test_a_motor_that_alternates_by_one_count_stands_still() -> None:
    """A count in a cycle is a speed, for which the winch reduces its tension for some cycles."""
    count_rad = one(1.5 * 0.0001 / CABLE_m)
    for still_for, far in ((3, 1.0), (60, 1.0), (3, 4.0)):
        stillness = Stillness(one(CABLE_m), count_rad, PERIOD_S)
        stillness.begin(one(0.0))
        lasted = [
            stillness.lasts(far * count_rad * (cycle // 80 % 2), cycle % 80 >= still_for)
            for cycle in range(1000)
        ]
        assert any(lasted) == (still_for == 3 and far == 1.0)


def test_a_heavy_cable_is_paid_out_a_little_and_held_against_its_tension() -> None:
    """The limit for light cables would let it run out."""
    pulls_N, inertia_kg_m2 = 2.5 * ENOUGH_N, 2.3e-4
    cable, feedback, torque_Nm = OneCable(), AxisFeedback(1), np.zeros(1)
    loop = WinchSpeedLoop(one(inertia_kg_m2), one(CABLE_m), PERIOD_S)
    cable.winch.hangs_N[:] = 3.5 * ENOUGH_N
    cable.enter(kernel.PAID_OUT)
    torque_Nm[:] = -CABLE_m * pulls_N
    loop.begin(feedback, one(0.0), torque_Nm)
    speed_rad_s, w = 0.0, cable.winch
    for _ in range(1000):
        w.high_N[:], w.low_N[:], w.paying_out_m_s[:] = 0.0, 0.0, -kernel.TAKE_UP_m_s
        w.speed_rad_s[:], w.tension_N[:] = loop.speed_rad_s, loop.tension_N
        kernel.take_up(w, cable.phase, cable.state, feedback.position_rad, one(PRETENSION_N), 1.0)
        if cable.phase[0] != kernel.PAID_OUT:
            break
        loop.high_N[:], loop.low_N[:] = w.high_N, w.low_N
        loop.paying_out_m_s[:] = w.paying_out_m_s
        loop.update(feedback, torque_Nm)
        speed_rad_s += PERIOD_S / inertia_kg_m2 * float(torque_Nm[0] + CABLE_m * pulls_N)
        feedback.position_rad += PERIOD_S * speed_rad_s
    assert cable.phase[0] == kernel.CLOSING  # without waiting for other cables
    assert w.high_N[0] >= pulls_N
    assert CABLE_m * feedback.position_rad[0] == pytest.approx(0.005, abs=0.001)
    assert CABLE_m * speed_rad_s == pytest.approx(kernel.TAKE_UP_m_s, rel=0.3)
