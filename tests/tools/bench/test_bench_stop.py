"""`cdpr bench stop` floods what it says it floods; how fast is for a machine that is not busy."""

from __future__ import annotations

from typing import Any

import pytest

from cdpr_tools.bench.daemon import stop as stop_bench
from cdpr_tools.output import Output

pytestmark = pytest.mark.long

STOPS = 6


@pytest.fixture(scope="module")
def figures() -> dict[str, Any]:
    return stop_bench.measure(STOPS, Output(as_json=True))


def test_each_stop_is_taken_by_the_loop_with_and_without_the_flood(figures: dict[str, Any]) -> None:
    for case in stop_bench.FLOODS:
        for transport in stop_bench.TRANSPORTS:
            ms = figures["ms"][case][transport]
            assert 0.0 < ms["p50"] <= ms["p99"] <= ms["max"]


def test_every_interface_is_flooded(figures: dict[str, Any]) -> None:
    kinds = {"unix", "http_with_key", "http_without_key", "websocket", "websocket_refused"}
    assert set(figures["sent"]) == kinds | {"idle_connections", "stream_packets"}
    assert min(figures["sent"].values()) > 0


def test_figures_are_told_for_people(figures: dict[str, Any]) -> None:
    text = "\n".join(stop_bench.report(figures))
    for words in ("nobody else asks, Unix socket", "4 clients flood", "http with key"):
        assert words in text
    assert text.count("reached") + text.count("MISSED") == 1
