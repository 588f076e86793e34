"""A robot of several test files."""

from pathlib import Path

import pytest

from tests.slower_robot import slower_robot


@pytest.fixture(scope="session")
def planar_file(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return slower_robot(tmp_path_factory.mktemp("robot"), "planar-3")
