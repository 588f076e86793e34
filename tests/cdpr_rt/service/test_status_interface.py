"""Status, events, metrics and the interface's page, over a real socket."""

from __future__ import annotations

import json
from functools import partial
from typing import Any

import pytest
from prometheus_client.parser import text_string_to_metric_families
from waiting import until

from cdpr_rt.service.listening import listen_udp
from cdpr_rt.service.setpoint_stream import SetpointStream
from tests.cdpr_rt.service.service_rig import AXES, Rig


class Unstartable:
    name = "recording"

    def start(self) -> None:
        raise OSError("no folder to record into")


def test_the_status_reports_parts_that_have_failed(own_rig: Rig) -> None:
    service = own_rig.service
    sock = listen_udp("127.0.0.1", 0)
    ended = partial(service.note_failure, SetpointStream.name)
    stream = SetpointStream(service.block, service.lease, sock, ended=ended)
    sock.close()
    service.start_parts([Unstartable(), stream])  # type: ignore[list-item]  # it gets no further
    until(lambda: bool(stream.status()["error"]))
    with own_rig.client() as client:
        parts = client.get("/status").json()["parts"]
        events = [event["text"] for event in client.get("/events").json()["events"]]
    assert parts["recording"]["error"] == "cannot start: no folder to record into"
    assert parts["stream"]["error"].startswith("the set-point stream ended: ")
    assert {f"recording: {parts['recording']['error']}", parts["stream"]["error"]} <= set(events)


def test_status_is_strict_json_with_every_axis(rig: Rig) -> None:
    def refuse(constant: str) -> Any:
        raise AssertionError(constant)

    rig.loop.publish(reason_limit={"value": float("nan")}, driving=False)
    with rig.client() as client:
        until(lambda: client.get("/status").json()["cycle"] is not None)
        status = json.loads(client.get("/status").text, parse_constant=refuse)
    assert status["reason_limit"] == {"value": None}
    assert status["driving"] is False
    assert [axis["name"] for axis in status["axes"]] == list(AXES)
    assert [axis["position_rad"] for axis in status["axes"]] == [0.0, 1.0]
    assert status["axes"][0]["tension_N"] is None
    assert status["cycle"]["state"] == "ready"


def test_events_are_reported_in_order(rig: Rig) -> None:
    with rig.client() as client:
        until(lambda: bool(client.get("/events").json()["events"]))
        last = client.get("/events").json()["events"][-1]["number"]
        for _ in range(3):
            client.post("/hold", json={"client": "maria"})
        rig.loop.publish(state="fault", reason="speed of left: 9 rad/s, 5 allowed")
        until(lambda: client.get("/status").json()["state"] == "fault")
        found: list[dict[str, Any]] = []

        def told() -> bool:
            found[:] = client.get("/events", params={"after": last}).json()["events"]
            return len(found) == 3

        until(told)
    assert [event["kind"] for event in found] == ["command", "state", "reason"]
    assert (found[0]["text"], found[0]["times"]) == ("hold by maria", 3)
    assert "5 allowed" in found[2]["text"]


def test_prometheus_parser_reads_the_metrics_and_every_cycle_is_counted(own_rig: Rig) -> None:
    rig = own_rig
    with rig.client() as client:
        until(lambda: int(rig.block.counters["rows"][0]) > 500)
        rig.loop.stand_still()
        cycles = int(rig.block.counters["rows"][0])
        samples: dict[Any, float] = {}

        def counted() -> bool:
            samples.update(
                ((sample.name, tuple(sample.labels.values())), sample.value)
                for family in text_string_to_metric_families(client.get("/metrics").text)
                for sample in family.samples
            )
            seen = samples[("cdpr_cycle_compute_seconds_count", ())]
            seen += samples[("cdpr_rows_not_seen_total", ())]
            assert seen <= cycles
            return seen == cycles

        until(counted)
    counted = samples[("cdpr_cycle_compute_seconds_count", ())]
    assert samples[("cdpr_cycles_total", ())] == cycles
    assert samples[("cdpr_cycle_compute_seconds_sum", ())] == pytest.approx(counted * 1e-4)
    assert samples[("cdpr_state", ("ready",))] == 1.0
    assert samples[("cdpr_axis_position_radians", ("right",))] == 1.0
    assert ("cdpr_axis_tension_newtons", ("right",)) not in samples
    assert samples[("cdpr_stream_age_seconds", ())] == 0.0


def test_the_page_loads_nothing_from_other_hosts(rig: Rig) -> None:
    with rig.client() as client:
        answer = client.get("/docs")
        paths = client.get("/openapi.json").json()["paths"]
    assert "default-src 'none'" in answer.headers["content-security-policy"]
    assert "<script" not in answer.text.lower()
    for path in paths:
        assert f"</span> {path}</h2>" in answer.text
