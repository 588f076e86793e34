"""The right to move: at most one holder, which loses it by silence."""

from __future__ import annotations

import threading

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cdpr_rt.core.shared_block import SharedBlock
from cdpr_rt.loop.right import PublishedRight
from cdpr_rt.service.lease import Lease, LeaseError

BLOCK = SharedBlock.create(1, 0.1, 100.0)


class Clock:
    def __init__(self) -> None:
        self.ns = 1_000_000_000

    def __call__(self) -> int:
        return self.ns


def made() -> tuple[Lease, Clock]:
    clock = Clock()
    return Lease(PublishedRight(BLOCK), clock), clock


def until_ns() -> int:
    """The published time until which the newest grant is valid."""
    return int(BLOCK.counters["right_until_ns"][0])


def test_nobody_holds_the_right_at_first_whatever_an_earlier_service_published() -> None:
    BLOCK.counters["right_until_ns"] = 1 << 62
    lease, _ = made()
    assert until_ns() == 0
    assert lease.holder() is None


@pytest.mark.parametrize("ttl_s", [0.0, -1.0, 0.19, 10.01, float("nan"), float("inf")])
def test_an_invalid_time_to_live_is_rejected(ttl_s: float) -> None:
    lease, _ = made()
    with pytest.raises(LeaseError, match=r"allowed: 0\.2 to 10 s"):
        lease.take("maria", ttl_s)
    assert until_ns() == 0


OPERATIONS = st.lists(
    st.tuples(
        st.sampled_from(["take", "renew", "release", "wait"]),
        st.integers(0, 3),
        st.floats(0.2, 3.0),
    ),
    max_size=60,
)


@settings(max_examples=200)
@given(OPERATIONS)
def test_at_most_one_token_is_valid_and_only_while_it_is_renewed(
    operations: list[tuple[str, int, float]],
) -> None:
    """Compared with a model that knows until when each token is valid."""
    lease, clock = made()
    tokens: dict[int, str] = {}
    holder, end_ns, ttl_ns = -1, 0, 0
    number = lease._right.number
    for what, who, seconds in operations:
        free = holder < 0 or clock.ns >= end_ns
        if what == "wait":
            clock.ns += round(seconds * 1e9)
        elif what == "take":
            if free:
                tokens[who] = lease.take(f"client {who}", seconds)
                ttl_ns = round(seconds * 1e9)
                holder, end_ns = who, clock.ns + ttl_ns
                number += 1
                assert lease.renew(tokens[who]).number == number
            else:
                with pytest.raises(LeaseError):
                    lease.take(f"client {who}", seconds)
        else:
            do = lease.renew if what == "renew" else lease.release
            if free or who != holder:
                with pytest.raises(LeaseError):
                    do(tokens.get(who))
            else:
                do(tokens[who])
                end_ns = clock.ns + ttl_ns if what == "renew" else 0
                holder = who if what == "renew" else -1
        assert until_ns() == end_ns
        assert BLOCK.counters["right_number"][0] == number


def test_one_of_many_simultaneous_clients_gets_the_right() -> None:
    lease = Lease(PublishedRight(BLOCK))
    got: list[str] = []
    begin = threading.Barrier(16)

    def ask(name: str) -> None:
        begin.wait()
        try:
            lease.take(name, 5.0)
        except LeaseError:
            return
        got.append(name)

    threads = [threading.Thread(target=ask, args=(f"client {k}",)) for k in range(16)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert len(got) == 1


def test_grant_numbers_continue_after_a_restart_of_the_service() -> None:
    first, _ = made()
    number = first.renew(first.take("maria", 2.0)).number
    second, _ = made()
    assert second.holder() is None
    assert second.renew(second.take("maria", 2.0)).number == number + 1
