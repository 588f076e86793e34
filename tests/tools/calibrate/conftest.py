"""Fixture for tests with a stand-in for a daemon."""

from __future__ import annotations

import pytest

from cdpr_tools.client import daemon_robot


@pytest.fixture
def daemon_time(monkeypatch: pytest.MonkeyPatch) -> None:
    """Advance the daemon's time with each request, so that no test has to wait."""
    monkeypatch.setattr(daemon_robot, "_LOOK_S", 0.0)
    monkeypatch.setattr(daemon_robot, "_OBSERVE_S", 0.0)
