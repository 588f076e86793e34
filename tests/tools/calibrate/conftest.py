"""What tests with a daemon that is made up share."""

from __future__ import annotations

import pytest

from cdpr_tools.client import daemon_robot


@pytest.fixture
def daemon_time(monkeypatch: pytest.MonkeyPatch) -> None:
    """The time of the daemon goes on with each question; nobody has to wait for it."""
    monkeypatch.setattr(daemon_robot, "_LOOK_S", 0.0)
    monkeypatch.setattr(daemon_robot, "_OBSERVE_S", 0.0)
