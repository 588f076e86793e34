"""A service shared by the tests of a module."""

from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.cdpr_rt.service.service_rig import Rig, running


@pytest.fixture(scope="module")
def shared(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Rig]:
    with running(tmp_path_factory.mktemp("service")) as rig:
        yield rig


@pytest.fixture
def rig(shared: Rig) -> Rig:
    shared.reset()
    return shared


@pytest.fixture
def own_rig(tmp_path: Path) -> Iterator[Rig]:
    with running(tmp_path) as rig:
        yield rig
