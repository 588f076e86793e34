from __future__ import annotations

from pathlib import Path

import pytest

from tests.sim_bus.canopen.slave_bench import Bench, odd_eds


@pytest.fixture
def bench() -> Bench:
    """Return a booted slave in PRE-OPERATIONAL."""
    return Bench().boot()


@pytest.fixture(scope="session")
def odd_eds_path(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return odd_eds(tmp_path_factory.mktemp("eds"))


@pytest.fixture
def odd_bench(odd_eds_path: Path) -> Bench:
    """Return a booted slave with objects of each type."""
    return Bench(odd_eds_path).boot()
