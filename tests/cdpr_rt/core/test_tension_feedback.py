"""Readings from the sampling task reach the cycle complete, with time, and become stale."""

from __future__ import annotations

import numpy as np

from cdpr_profiles.robot_limits import Limit
from cdpr_rt.core.exchange import TensionExchange, TensionFault, TensionWatch
from cdpr_rt.core.fault import LOAD_CELL, LOAD_CELL_HIGH, fault_text


class Clock:
    """A clock whose time the test sets."""

    now_s = 100.0


def exchange(clock: Clock, n: int = 3) -> TensionExchange:
    return TensionExchange([f"winch {i + 1}" for i in range(n)], 0.25, clock)


def test_no_reading_is_valid_before_the_first_update() -> None:
    clock = Clock()
    both = exchange(clock)
    both.update()
    assert not both.feedback.valid.any()
    assert np.isinf(both.feedback.age_s).all()
    assert both.reason() == "winch 1: tension sensor: no reading"


def test_a_reading_has_a_time_and_becomes_stale() -> None:
    clock = Clock()
    both = exchange(clock)
    for i in range(3):
        both.publish(i, 10.0 * (i + 1), 100.0 + 0.01 * i, TensionFault.NONE)
    clock.now_s = 100.1
    both.update()
    told = both.feedback
    np.testing.assert_allclose(told.tension_N, [10.0, 20.0, 30.0])
    np.testing.assert_allclose(told.age_s, [0.1, 0.09, 0.08])
    assert told.valid.all() and both.reason() == ""
    both.publish(1, 21.0, 100.2, TensionFault.NONE)
    clock.now_s = 100.24
    both.update()
    np.testing.assert_array_equal(told.valid, [True, True, True])
    clock.now_s = 100.36
    both.update()
    np.testing.assert_array_equal(told.valid, [False, True, False])
    assert both.reason() == ("winch 1: tension sensor: stale, last read 0.36 s ago, 0.25 s allowed")
    found = TensionWatch(both).fault()
    assert found is not None and (found.limit, found.detail) == (Limit.SAFETY_STOP, both.reason())


def test_a_fault_is_reported_with_its_cable_until_it_is_repaired() -> None:
    clock = Clock()
    both = exchange(clock)
    for i in range(3):
        both.publish(i, 50.0, 100.0, TensionFault.NONE)
    both.publish(2, 1020.0, 100.0, TensionFault.OVER_RANGE)
    both.update()
    np.testing.assert_array_equal(both.feedback.valid, [True, True, False])
    assert both.feedback.fault[2] == TensionFault.OVER_RANGE
    assert both.reason() == "winch 3: tension sensor: over range (1020.0 N)"
    both.publish(2, 60.0, 100.0, TensionFault.BROKEN_WIRE)
    both.update()
    assert both.reason() == "winch 3: tension sensor: broken wire"
    both.publish(2, 60.0, 100.0, TensionFault.NONE)
    both.update()
    assert both.feedback.valid.all()


def test_a_watch_reports_high_tension_and_sensor_faults() -> None:
    clock = Clock()
    both = exchange(clock)
    watch = TensionWatch(both, 80.0)
    for i, tension in enumerate((20.0, 79.9, 50.0)):
        both.publish(i, tension, 100.0, TensionFault.NONE)
    assert watch.fault() is None
    both.publish(1, 80.1, 100.0, TensionFault.NONE)
    assert told(watch) == "load cell winch 2: 80.1 N, 80 N allowed"
    both.publish(0, 0.0, 100.0, TensionFault.BROKEN_WIRE)
    assert told(watch) == "winch 1: tension sensor: broken wire"


def test_a_watch_of_one_load_cell_reports_axis_and_code() -> None:
    one = exchange(Clock(), 1)
    watch = TensionWatch(one, 80.0)
    one.publish(0, 80.1, 100.0, TensionFault.NONE)
    high = watch.fault()
    one.publish(0, 0.0, 100.0, TensionFault.BROKEN_WIRE)
    dead = watch.fault()
    assert high is not None and dead is not None
    assert (high.axis, high.code, high.value, high.allowed) == (0, LOAD_CELL_HIGH, 80.1, 80.0)
    assert (dead.axis, dead.code) == (0, LOAD_CELL)


def told(watch: TensionWatch) -> str:
    fault = watch.fault()
    return "" if fault is None else fault_text(fault, ())
