"""`cdpr drive configure` and `cdpr drive errors` with a simulated drive."""

from __future__ import annotations

import json
import os
from collections.abc import Iterator
from typing import Any

import pytest
from cdpr_here import cdpr_here

from cdpr_tools.composition.simulator import OwnSimulator

WINCH = "winch-mpp0923d"


@pytest.fixture(scope="module")
def bus() -> Iterator[str]:
    simulator = OwnSimulator(WINCH, f"simbus:configure-{os.getpid()}")
    try:
        yield simulator.bus
    finally:
        simulator.stop()


def _cdpr(*words: str) -> tuple[int, dict[str, Any], str]:
    done = cdpr_here(*words, "--json")
    last = (done.stdout.strip().splitlines() or ["{}"])[-1]
    return done.returncode, json.loads(last), done.stderr


def test_a_stored_configuration_is_recognised_at_the_next_boot(bus: str) -> None:
    status, told, _ = _cdpr("drive", "configure", WINCH, "--bus", bus, "--store")
    assert status == 0
    assert told["stored"]
    assert "1017h:0 = 100" in told["changed"]
    assert _cdpr("drive", "od", WINCH, "1020:1", "--bus", bus)[0] == 0
    status, told, _ = _cdpr("drive", "configure", WINCH, "--bus", bus, "--store")
    assert status == 0
    assert (told["vouched"], told["stored"], told["changed"]) == (True, False, [])


def test_the_error_history_of_a_drive_is_shown_as_text(bus: str) -> None:
    assert _cdpr("drive", "errors", WINCH, "--bus", bus)[1]["history"] == []
    for code in ("0x7305", "0x4310"):
        _cdpr("drive", "od", WINCH, "2F00:1", "--set", code, "--bus", bus)
        assert _cdpr("drive", "reset", WINCH, "--bus", bus)[0] == 0
    status, told, _ = _cdpr("drive", "errors", WINCH, "--bus", bus)
    assert status == 0
    assert [entry["text"] for entry in told["history"]] == [
        "4310h drive temperature too high",
        "7305h incremental encoder 1",
    ]
