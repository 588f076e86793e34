"""A robot on its stand with loose cables."""

from __future__ import annotations

from collections.abc import Iterator

import pytest

from tests.cdpr_rt.programs.standing_robot import Standing


@pytest.fixture(scope="module")
def made() -> Standing:
    return Standing()


@pytest.fixture
def robot(made: Standing) -> Iterator[Standing]:
    made.loosen((0.02, 0.005, 0.03))
    yield made
