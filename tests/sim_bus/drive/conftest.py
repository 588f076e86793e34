"""Fixtures of the drive's tests."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parent))
from drive_rig import Rig


@pytest.fixture
def rig() -> Rig:
    return Rig()
