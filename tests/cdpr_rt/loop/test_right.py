"""Which grant of the right to move is valid, as the loop reads it while the service writes."""

from __future__ import annotations

from collections.abc import Callable

import pytest

from cdpr_rt.core.shared_block import SharedBlock
from cdpr_rt.loop.right import LONGEST_S, PublishedRight, RightToMove

NOW_NS = 50_000_000_000
LONGEST_NS = round(LONGEST_S * 1e9)


class Clock:
    """Stands still; reading it can make something happen between two reads of the memory."""

    def __init__(self) -> None:
        self.between: Callable[[], object] = int

    def __call__(self) -> int:
        between, self.between = self.between, int
        between()
        return NOW_NS


@pytest.fixture
def sides() -> tuple[PublishedRight, RightToMove, Clock]:
    block, clock = SharedBlock.create(1, 0.1, 100.0), Clock()
    return PublishedRight(block), RightToMove(block, clock), clock


Sides = tuple[PublishedRight, RightToMove, Clock]


def test_only_the_newest_grant_is_valid_until_its_time_ends(sides: Sides) -> None:
    service, loop, _ = sides
    assert loop.current == 0
    first = service.begin(NOW_NS + 1)
    assert loop.current == first
    assert loop.refusal(first) == ""
    service.until(NOW_NS)
    assert loop.current == 0
    assert "nobody holds" in loop.refusal(first)
    second = service.begin(NOW_NS + 1)
    assert second > first
    assert "another client has" in loop.refusal(first)
    service.until(0)
    assert loop.current == 0


@pytest.mark.parametrize(
    ("ahead_ns", "holds"),
    [(LONGEST_NS, True), (LONGEST_NS + 1, False), (1 << 62, False), (-(1 << 62), False)],
)
def test_a_grant_for_longer_than_any_service_gives_is_invalid(
    sides: Sides, ahead_ns: int, holds: bool
) -> None:
    service, loop, _ = sides
    number = service.begin(NOW_NS + ahead_ns)
    assert loop.current == (number if holds else 0)


def test_a_grant_that_changes_during_a_read_is_invalid(sides: Sides) -> None:
    service, loop, clock = sides
    first = service.begin(NOW_NS + 1)
    clock.between = lambda: service.begin(NOW_NS + 1)
    assert loop.current == 0
    assert loop.current == first + 1


def test_the_mover_loses_the_right_with_its_grant(sides: Sides) -> None:
    service, loop, _ = sides
    loop.mover = service.begin(NOW_NS + 1)
    assert loop.loss() == ""
    service.until(0)
    assert "nobody" in loop.loss()
    service.begin(NOW_NS + 1)
    assert "another client has taken" in loop.loss()
