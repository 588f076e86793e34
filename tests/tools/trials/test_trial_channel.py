"""The bad network of the stream trial has exactly the specified losses and delays."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cdpr_tools.trials.streaming import Channel, Network

SHARES = st.floats(0.0, 0.9)


def transport(network: Network, seed: int, count: int) -> tuple[Channel, list[tuple[float, int]]]:
    """Send `count` packets at 50 Hz. Return arrival times of those that arrived, in order."""
    channel = Channel(network, np.random.default_rng(seed))
    came = []
    for step in range(50 * (count + 50)):
        now_s = step * 4e-4
        if step % 50 == 0 and step < 50 * count:
            channel.send((step // 50).to_bytes(4, "little"), now_s)
        came += [(now_s, int.from_bytes(data, "little")) for data in channel.arrived(now_s)]
    return channel, came


@given(loss=SHARES, duplicates=SHARES, jitter_s=st.floats(0.0, 0.1), seed=st.integers(0, 9))
@settings(max_examples=20)
def test_a_packet_arrives_within_its_jitter_or_never(loss, duplicates, jitter_s, seed):
    network = Network(loss, duplicates, 0.02, jitter_s)
    channel, came = transport(network, seed, 100)
    transit_s = [at - number * 0.02 for at, number in came]
    assert all(0.02 - 1e-9 <= each <= 0.02 + jitter_s + 4.1e-4 for each in transit_s)
    numbers = [number for _, number in came]
    assert len(set(numbers)) == channel.sent - channel.lost
    assert len(numbers) - len(set(numbers)) == channel.doubled


def test_losses_and_duplicates_have_the_requested_shares():
    channel, came = transport(Network(), 3, 4000)
    assert channel.lost / channel.sent == pytest.approx(0.2, abs=0.02)
    assert channel.doubled / (channel.sent - channel.lost) == pytest.approx(0.1, abs=0.02)
    numbers = [number for _, number in came]
    behind = sum(a > b for a, b in zip(np.maximum.accumulate(numbers), numbers, strict=True))
    assert behind > 200
    assert channel.overtaken == behind
