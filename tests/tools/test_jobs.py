"""Work in parts, in processes of this machine."""

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
            os._exit(9)  # as where the system ends it for want of memory
        return self.number**2


@pytest.mark.parametrize("workers", [1, 2])
def test_results_come_in_the_order_of_jobs(workers: int) -> None:
    with runner(workers, None) as run:
        assert list(run([Square(k) for k in range(7)])) == [k**2 for k in range(7)]


def test_a_process_that_dies_ends_the_work() -> None:
    with (
        runner(2, None) as run,
        pytest.raises(WorkFailedError, match="has died; is there too little memory"),
    ):
        list(run([Square(1), Square(-1), Square(2)]))
