"""What a client calls itself."""

from __future__ import annotations

import os
import pwd

import httpx
import pytest

from cdpr_tools.client.client import Daemon


def test_a_user_without_a_name_can_command_too(monkeypatch: pytest.MonkeyPatch) -> None:
    def unknown(uid: int) -> None:
        raise KeyError(f"getpwuid(): uid not found: {uid}")

    for variable in ("LOGNAME", "USER", "LNAME", "USERNAME"):
        monkeypatch.delenv(variable, raising=False)
    monkeypatch.setattr(pwd, "getpwuid", unknown)
    with httpx.Client() as http:
        assert Daemon(http, "here").name.startswith(f"#{os.getuid()}@")
