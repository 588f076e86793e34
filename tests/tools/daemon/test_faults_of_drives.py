"""Each drive fault is reported with axis and code in status, recording and HTTP."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import httpx
import pytest

from cdpr_drivers.axes import axis_codec as codec
from cdpr_drivers.axes.axis_group import StateArrays, axis_faults
from cdpr_drivers.axes.listening import monitored_axis
from cdpr_profiles import load_robot
from cdpr_profiles.robot_limits import Limit
from cdpr_rt.core.fault import fault_text
from cdpr_rt.core.states import LoopState
from cdpr_rt.service.http_app import create_app
from cdpr_rt.service.recording import Recorder
from cdpr_rt.service.service import Service
from cdpr_tools.composition.loop_parts import description
from tests.cdpr_rt.service.recording_rig import stock_messages
from tests.tools.daemon.loop_rig import LoopRig, opened
from tests.tools.robot_rig import robot_file, simulated

RAISE_FAULT, SHOW_MODE, MUTE, DOUBLE, BABBLE = 1, 4, 5, 7, 9
AXIS = 1


def injected(sub: int, value: int) -> Callable[[LoopRig], None]:
    return lambda rig: rig.inject_fault(AXIS, sub, value)


def nmt(command: int) -> Callable[[LoopRig], None]:
    def send(rig: LoopRig) -> None:
        axis = rig.robot.axes[AXIS]
        rig.machine.networks[axis.bus].send(0, bytes([command, axis.node_id]))

    return send


def disabled_by_another(rig: LoopRig) -> None:
    axis = rig.robot.axes[AXIS]
    rig.machine.networks[axis.bus].write(axis.node_id, 0x6040, 0, 0)


KINDS: dict[str, Callable[[LoopRig], None]] = {
    "7305h": injected(RAISE_FAULT, 0x7305),
    "restarted": nmt(129),
    "no_heartbeat": injected(MUTE, 1),
    "wrong_mode": injected(SHOW_MODE, 8),
    "left_enabled": disabled_by_another,
    "doubled": injected(DOUBLE, 255),
    "FF00h": injected(BABBLE, 60),
}


@pytest.fixture(scope="module", params=["two axes", "planar-3"])
def lab(
    request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory
) -> Iterator[tuple[Path, str]]:
    folder = tmp_path_factory.mktemp("robot")
    path = load_robot("planar-3").path
    if request.param == "two axes":
        path = robot_file(folder, [("can0", 1), ("can0", 2)], period_s=2e-3)
    with simulated(path) as url:
        yield path, url


def http_status(rig: LoopRig) -> dict[str, Any]:
    async def ask() -> httpx.Response:
        transport = httpx.ASGITransport(create_app(Service(rig.block, "bench")))
        async with httpx.AsyncClient(transport=transport, base_url="http://robot") as client:
            return await client.get("/status")

    answer = asyncio.run(ask())
    assert answer.status_code == 200, answer.text
    status: dict[str, Any] = answer.json()
    return status


def mend(rig: LoopRig) -> None:
    for sub in (SHOW_MODE, MUTE, DOUBLE, BABBLE):
        try:
            rig.inject_fault(AXIS, sub, 0)
        except Exception as error:
            raise AssertionError(f"2F00h:{sub:02X}: {error}") from error


def test_a_drives_fault_is_reported_with_its_axis_and_code(
    lab: tuple[Path, str], tmp_path: Path
) -> None:
    with opened(*lab) as rig:
        parts = rig.loop.engine.parts
        rig.block.write_description(description(rig.robot, parts.supervisor.limits, parts))
        recorder = Recorder(rig.block, tmp_path, "bench", reserve_bytes=0)
        recorder.begin()
        name, told = rig.robot.axes[AXIS].name, list[str]()
        for code, inject in KINDS.items():
            rig.drop_right()  # nobody holds the right after the start of a service
            rig.take_right()
            rig.obeyed("enable", program="hold")
            rig.turn(5)
            rig.rows()
            inject(rig)
            rig.turn_until(lambda: rig.loop.engine.reacting > 0 or rig.state is LoopState.FAULT)
            rows = rig.rows()
            tripped = rows[rows["limit"] == Limit.DRIVE]
            assert set(tripped["limit_axis"]) == {AXIS}, code
            status = rig.status
            recorder.look()
            for seen in (status["reason_limit"], status["faults"][0]):
                assert (seen["limit"], seen["axis"], seen["name"], seen["code"]) == (
                    "drive", AXIS, name, code,
                )  # fmt: skip
            assert status["reason"].startswith(f"{name}: the drive (bus ") or code == "doubled"
            over_http = http_status(rig)
            assert over_http["faults"] == status["faults"]
            told.append(code)
            rig.turn_until(lambda: rig.state is LoopState.FAULT and not rig.loop.busy)
            mend(rig)
            rig.run(0.3)
            rig.turn_until(lambda: bool(rig.command("acknowledge")["ok"]))
        recorder.finish()
    file = Path(recorder.status()["file"])
    events = [event for _, event in stock_messages(file, "/events")]
    limits = [event["limit"] for event in events if isinstance(event.get("limit"), dict)]
    recorded = [limit["code"] for limit in limits if limit["axis"] == AXIS]
    assert list(dict.fromkeys(recorded)) == told
    assert {limit["axis"] for limit in limits} == {AXIS}


BITS = {
    codec.RESTARTED: "restarted",
    codec.FLOODING: "flooding",
    codec.EMERGENCY_MESSAGE: "7305h",
    codec.FAULT: "in_fault",
    codec.WRONG_MODE: "wrong_mode",
    codec.LEFT_ENABLED: "left_enabled",
    codec.SILENT: "silent",
    codec.UNSTEADY: "unsteady",
    codec.NO_HEARTBEAT: "no_heartbeat",
    codec.NOT_OPERATIONAL: "not_operational",
    codec.NOT_FINITE: "not_finite",
}


@pytest.mark.parametrize("bit", BITS)
def test_each_alarm_of_a_drive_becomes_a_fault_of_its_axis(bit: int) -> None:
    winch = load_robot("planar-3").axes[0].winch
    axes = [monitored_axis(winch, node) for node in (1, 2)]
    state = StateArrays(2)
    state.begin(axes, 1e-3, lockstep=False)
    state.ints[codec.ALARM, 1] = bit
    state.ints[codec.EMERGENCY, 1] = 0x7305
    (fault,) = axis_faults(axes, state.ints)
    assert (fault.limit, fault.axis, fault.code) == (Limit.DRIVE, 1, BITS[bit])
    assert fault.source == "node 2"
    assert fault_text(fault, ("left", "right")).startswith("right: ")


FIGURES = (
    codec.WRONG_MODE,
    codec.LEFT_ENABLED,
    codec.SILENT,
    codec.UNSTEADY,
    codec.NOT_OPERATIONAL,
)
