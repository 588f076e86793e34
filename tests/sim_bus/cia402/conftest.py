"""Fixture of a simulated drive."""

from __future__ import annotations

import pytest

from tests.sim_bus.cia402.drive_rig import Rig


@pytest.fixture
def rig() -> Rig:
    return Rig()
