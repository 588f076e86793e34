"""A robot of several test files."""

from pathlib import Path

import pytest

from cdpr_profiles.places import SHIPPED


@pytest.fixture(scope="session")
def planar_file(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Write the shipped planar-3 with a quarter of the cycle rate, which takes less time."""
    path = tmp_path_factory.mktemp("robot") / "planar-3.toml"
    shipped = (SHIPPED / "robots" / "planar-3.toml").read_text()
    path.write_text(shipped.replace("sync_period_s = 0.001", "sync_period_s = 0.004"))
    return path
