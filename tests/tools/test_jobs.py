"""Jobs run in processes of this machine."""

from __future__ import annotations

import os
from dataclasses import dataclass

import pytest

from cdpr_tools.errors import WorkFailedError
from cdpr_tools.processes import runner


@dataclass(frozen=True)
class Square:
    number: int

    def run(self) -> int:
        if self.number < 0:
            os._exit(9)  # as if the system killed it for lack of memory
        return self.number**2


@pytest.mark.parametrize("workers", [1, 2])
def test_results_are_in_the_order_of_jobs(workers: int) -> None:
    with runner(workers, None) as run:
        assert list(run([Square(k) for k in range(7)])) == [k**2 for k in range(7)]


def test_a_dying_process_ends_all_jobs() -> None:
    with (
        runner(2, None) as run,
        pytest.raises(WorkFailedError, match="has died; is there too little memory"),
    ):
        list(run([Square(1), Square(-1), Square(2)]))
