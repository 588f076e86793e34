"""The address of set-points, from the daemon or the user."""

from __future__ import annotations

from pathlib import Path

import pytest

from cdpr_tools.errors import BadInputError
from cdpr_tools.teleop.input_device import InputDevice
from cdpr_tools.teleop.script import ScriptDevice, ScriptLine
from cdpr_tools.teleop.teleoperation import TeleopSettings, stream_address


def open_device() -> InputDevice:
    return ScriptDevice((ScriptLine(0.0, (0.0, 0.0, 0.0)),))


def address(listens: str | None, url: str | None = None, via: str | None = None) -> tuple[str, int]:
    parts = {} if listens is None else {"stream": {"address": listens}}
    settings = TeleopSettings(
        "planar-3", open_device, 1.0, via, None if url else Path("s"), url, None
    )
    return stream_address({"robot": "planar-3", "parts": parts}, settings)


def test_the_stream_has_the_host_of_the_daemon() -> None:
    assert address("127.0.0.1:7710") == ("127.0.0.1", 7710)
    assert address("0.0.0.0:7710") == ("127.0.0.1", 7710)
    assert address("0.0.0.0:7710", url="http://robot.example:7711") == ("robot.example", 7710)
    assert address(":::7710", url="http://[::1]:7711") == ("::1", 7710)
    assert address("10.0.0.7:7710", url="http://10.0.0.7:7711") == ("10.0.0.7", 7710)
    assert address("127.0.0.1:7710", via="tunnel:1234") == ("tunnel", 1234)
    assert address(None, via="4000") == ("127.0.0.1", 4000)


def test_a_daemon_without_stream_is_reported() -> None:
    with pytest.raises(
        BadInputError, match=r"planar-3: .* started with --no-stream or --read-only"
    ):
        address(None)


def test_a_stream_on_loopback_cannot_be_reached_from_another_machine() -> None:
    assert address("127.0.0.1:7710", url="http://localhost:7711") == ("127.0.0.1", 7710)
    with pytest.raises(BadInputError, match=r"only from its own machine; allowed: .* --stream"):
        address("127.0.0.1:7710", url="http://robot.example:7711")
