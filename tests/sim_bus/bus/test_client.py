"""The time when a packet was sent, from the kernel's wall-clock timestamp."""

from __future__ import annotations

from unittest import mock

import pytest

from cdpr_sim_bus.bus import client


def test_preemption_between_two_clock_readings_does_not_shift_the_time() -> None:
    # preempted for 0.2 s after the first reading; the second pair is close together
    monotonic, wall = [10.0, 10.2, 10.2, 10.20001], [100.2, 100.2]
    with (
        mock.patch.object(client.time, "monotonic", side_effect=monotonic),
        mock.patch.object(client.time, "time", side_effect=wall),
    ):
        assert client.sent_at(100.1) == pytest.approx(10.1)


def test_a_timestamp_in_the_future_counts_as_now() -> None:
    with (
        mock.patch.object(client.time, "monotonic", return_value=10.0),
        mock.patch.object(client.time, "time", return_value=100.0),
    ):
        assert client.sent_at(500.0) == 10.0
