"""Procedures of the page: one at a time, under the right to move, from a fixed list."""

from __future__ import annotations

import asyncio
import contextlib
import json
import os
import struct
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import httpx
import pytest
from waiting import until

from cdpr_rt.core.shared_block import SharedBlock
from cdpr_rt.loop.right import PublishedRight
from cdpr_rt.service.lease import Lease
from cdpr_rt.service.procedure_runner import Procedure, ProcedureError, ProcedureRunner
from tests.cdpr_rt.service.service_rig import KEY, Rig

RIGHT = {"Authorization": f"Bearer {KEY.decode()}"}
COMMISSION = {"procedure": "commission", "axes": ["left"], "detached": True, "client": "maria"}
AT_WORK = """
import json, os, pathlib, signal, sys, threading, time
stops = []
signal.signal(signal.SIGINT, lambda *_: stops.append(1))
threading.Thread(target=lambda: (sys.stdin.read(), stops.append(2)), daemon=True).start()
print(json.dumps({"progress": {"what": "slow sweeps", "share": 0.5}}), flush=True)
print(os.environ["TOKEN"] != "", "drum turns", file=sys.stderr, flush=True)
while not stops and not pathlib.Path(sys.argv[1], "done").exists():
    time.sleep(0.01)
pathlib.Path(sys.argv[1], "report.html").write_text("<p>good")
print(json.dumps({"ok": not stops, "stops": stops}), flush=True)
"""


@pytest.fixture
def folder(rig: Rig, tmp_path: Path) -> Iterator[Path]:
    """Let the service run a made-up procedure in this folder; it ends when `done` is there."""

    def plan(request: Any) -> Procedure:
        if request.axes != ["left"]:
            raise ProcedureError("axis 'up'; allowed: left, right")
        command = (sys.executable, "-c", AT_WORK, str(tmp_path))
        reports = (("left", "report.html"), ("right", "nothing.html"))
        return Procedure("commissioning", (command,), "TOKEN", tmp_path, reports, takes_bus=True)

    rig.service.procedures.plan = plan
    yield tmp_path
    (tmp_path / "done").touch()
    until(lambda: not job(rig)["running"])
    rig.service.procedures.plan = None


def job(rig: Rig) -> dict[str, Any]:
    return dict(httpx.get(f"{rig.guarded_url}/procedure", headers=RIGHT).json())


def ask(rig: Rig, body: Any, **headers: str) -> httpx.Response:
    return httpx.post(f"{rig.guarded_url}/procedure", json=body, headers={**RIGHT, **headers})


@contextlib.contextmanager
def in_control(rig: Rig, ttl_s: float = 10.0) -> Iterator[dict[str, str]]:
    body = {"client": "maria", "ttl_s": ttl_s}
    answer = httpx.post(f"{rig.guarded_url}/control", json=body, headers=RIGHT)
    yield {"X-Control-Token": answer.json()["token"]}
    rig.reset()


def test_a_procedure_takes_the_buses_reports_progress_and_serves_its_report(
    rig: Rig, folder: Path
) -> None:
    with in_control(rig) as token:
        assert ask(rig, COMMISSION, **token).json()["running"]
        until(lambda: job(rig)["steps"] == [{"what": "slow sweeps", "share": 0.5}])
        until(lambda: job(rig)["lines"] == ["True drum turns"])
        assert [one["do"] for one in rig.loop.commands] == ["release"]
        second = ask(rig, COMMISSION, **token)
        assert (second.status_code, second.json()["error"]) == (409, "commissioning is running")
        (folder / "done").touch()
        until(lambda: not job(rig)["running"])
        assert [one["do"] for one in rig.loop.commands] == ["release", "configure", "check"]
    ended = job(rig)
    assert ended["result"] == {"ok": True, "stops": []}
    (report,) = ended["reports"]
    assert httpx.get(f"{rig.guarded_url}{report['path']}").text == "<p>good"


@pytest.mark.parametrize("how", ["DELETE /procedure", "POST /hold", "the right", "its client"])
def test_a_cancel_a_stop_or_a_lost_right_ends_a_procedure(rig: Rig, folder: Path, how: str) -> None:
    with in_control(rig, 2.0 if how == "its client" else 10.0) as token:
        assert ask(rig, COMMISSION, **token).status_code == 200
        until(lambda: job(rig)["steps"])
        if how == "the right":
            url = f"{rig.guarded_url}/control"
            assert httpx.delete(url, headers={**RIGHT, **token}).status_code == 200
        elif how != "its client":
            method, path = how.split()
            answer = httpx.request(method, f"{rig.guarded_url}{path}", headers=RIGHT)
            assert answer.status_code == 200
        until(lambda: not job(rig)["running"])
    assert job(rig)["result"] == {"ok": False, "stops": [1]}
    assert job(rig)["error"].startswith("ended: ")


def test_a_procedure_that_reports_nonsense_is_killed_before_the_buses_are_taken_again(
    rig: Rig, tmp_path: Path
) -> None:
    text = 'import time; print("{\\"progress\\": {}}", flush=True); time.sleep(600)'
    command = (sys.executable, "-c", text)
    rig.service.procedures.plan = lambda _: Procedure(
        "commissioning", (command,), "TOKEN", tmp_path, takes_bus=True
    )
    with in_control(rig) as token:
        ask(rig, COMMISSION, **token)
        until(lambda: not job(rig)["running"])
        assert "could not be read" in job(rig)["error"]
        assert [one["do"] for one in rig.loop.commands] == ["release", "configure", "check"]
    rig.service.procedures.plan = None


def test_nobody_boots_the_drives_that_a_procedure_runs(rig: Rig, folder: Path) -> None:
    with in_control(rig) as token:
        ask(rig, COMMISSION, **token)
        until(lambda: job(rig)["steps"])
        answer = httpx.post(f"{rig.guarded_url}/configure", headers=RIGHT)
        assert (answer.status_code, job(rig)["running"]) == (409, True)
        assert "a procedure runs the drives" in answer.json()["error"]
        assert [one["do"] for one in rig.loop.commands] == ["release"]
        rig.loop.publish(released=True)
        until(lambda: rig.service.status()["released"])
        rig.service.procedures.cut("emergency stop")
        until(lambda: not job(rig)["running"])
        assert not rig.service.status()["released"]  # anybody may boot the drives now
        rig.loop.publish(released=False)


def test_a_dead_service_takes_its_procedure_with_it(rig: Rig, folder: Path) -> None:
    with in_control(rig) as token:
        ask(rig, COMMISSION, **token)
        until(lambda: job(rig)["steps"])
        process = rig.service.procedures._process
        assert process is not None and process.stdin is not None
        process.stdin.close()  # as the kernel does
        until(lambda: not job(rig)["running"])
    assert job(rig)["result"] == {"ok": False, "stops": [2]}


@pytest.mark.parametrize("how", ["is interrupted", "hangs"])
def test_a_restarted_service_ends_the_procedure_before_the_loop_takes_its_buses(how: str) -> None:
    asyncio.run(_recover(how))


async def _recover(how: str) -> None:
    ignore = "signal.signal(signal.SIGINT, signal.SIG_IGN);" * (how == "hangs")
    text = f"import signal, time; {ignore} print(flush=True); time.sleep(600)"
    command = (sys.executable, "-c", text)
    with subprocess.Popen(command, stdout=subprocess.PIPE, start_new_session=True) as orphan:
        assert orphan.stdout is not None
        orphan.stdout.read(1)
        block = SharedBlock.create(1, 0.1, 100.0)
        block.counters["procedure_pid"] = orphan.pid
        alive_when_taken: list[bool] = []

        async def buses(take: bool) -> str:
            alive_when_taken.append(orphan.poll() is None)
            return "" if take else "only taken"

        pid = block.counters["procedure_pid"]
        runner = ProcedureRunner(Lease(PublishedRight(block)), lambda _: None, buses, pid)
        runner.recover()
        watching = asyncio.create_task(runner.watch())
        assert runner.has_bus
        if how == "hangs":
            runner.cut("emergency stop")
        while runner.has_bus:
            orphan.poll()  # the launcher's init does this
            await asyncio.sleep(0.01)
        watching.cancel()
        assert alive_when_taken == ([] if how == "hangs" else [False])
        assert orphan.poll() is not None
        assert runner.job()["error"] == "ended: its service was killed"


ENDS_SLOWLY = """
import os, pathlib, signal, sys, time
signal.signal(signal.SIGINT, signal.SIG_IGN)
print(os.environ["TOKEN"], file=sys.stderr, flush=True)
while not pathlib.Path(sys.argv[1], "done").exists():
    time.sleep(0.01)
"""
MOVES = """
import os, sys
print(os.environ["TOKEN"], file=sys.stderr, flush=True)
sys.stdin.read()
"""


def test_while_a_procedure_moves_the_robot_its_client_cannot(rig: Rig, tmp_path: Path) -> None:
    command = (sys.executable, "-c", MOVES)
    rig.service.procedures.plan = lambda _: Procedure(
        "measurement of poses", (command,), "TOKEN", tmp_path, moves=True
    )

    def jog(token: dict[str, str]) -> httpx.Response:
        body = {"program": "jog", "wanted": {}}
        return httpx.post(f"{rig.guarded_url}/program", json=body, headers={**RIGHT, **token})

    with in_control(rig) as token:
        assert ask(rig, COMMISSION, **token).status_code == 200
        until(lambda: job(rig)["lines"])
        assert "measurement of poses moves the robot" in jog(token).json()["error"]
        lent = {"X-Control-Token": job(rig)["lines"][0]}
        assert jog(lent).status_code == 200
        control = httpx.get(f"{rig.guarded_url}/control", headers=RIGHT).json()
        assert (control["client"], control["procedure"]) == ("maria", "measurement of poses")
        url = f"{rig.guarded_url}/control"
        assert httpx.put(url, headers={**RIGHT, **token}).status_code == 200
        httpx.delete(f"{rig.guarded_url}/procedure", headers=RIGHT)
        until(lambda: not job(rig)["running"])
        assert jog(lent).status_code == 409
        assert jog(token).status_code == 200
    rig.service.procedures.plan = None


def test_a_procedure_that_was_stopped_moves_the_robot_no_more_while_it_ends(
    rig: Rig, tmp_path: Path
) -> None:
    command = (sys.executable, "-c", ENDS_SLOWLY, str(tmp_path))
    rig.service.procedures.plan = lambda _: Procedure(
        "measurement of poses", (command,), "TOKEN", tmp_path, moves=True
    )
    with in_control(rig) as token:
        assert ask(rig, COMMISSION, **token).status_code == 200
        until(lambda: job(rig)["lines"])
        lent = {**RIGHT, "X-Control-Token": job(rig)["lines"][0]}
        assert httpx.post(f"{rig.guarded_url}/hold", headers=RIGHT).status_code == 200
        body = {"program": "jog", "wanted": {}}
        answer = httpx.post(f"{rig.guarded_url}/program", json=body, headers=lent)
        assert answer.status_code == 409
        assert "stops under control" in answer.json()["error"]
        assert job(rig)["running"]
        (tmp_path / "done").touch()
        until(lambda: not job(rig)["running"])
    rig.service.procedures.plan = None


@pytest.mark.parametrize(
    ("body", "status", "why"),
    [
        ({**COMMISSION, "procedure": "sh"}, 422, "procedure"),
        ({**COMMISSION, "detached": False}, 422, "detached"),
        ({**COMMISSION, "axes": []}, 422, "axes"),
        ({**COMMISSION, "axes": ["a" * 65]}, 422, "axes"),
        ({**COMMISSION, "out": "/etc"}, 422, "out"),
        ({"procedure": "adopt", "measurement": "../../etc"}, 422, "measurement"),
        ({**COMMISSION, "axes": ["--help; rm -r /"]}, 409, "allowed: left, right"),
        (["commission"], 422, ""),
    ],
)
def test_only_listed_procedures_with_checked_values_begin(
    rig: Rig, folder: Path, body: Any, status: int, why: str
) -> None:
    with in_control(rig) as token:
        answer = ask(rig, body, **token)
    assert answer.status_code == status
    assert why in answer.json()["error"]
    assert not job(rig)["running"]
    assert not rig.loop.commands


def test_a_procedure_needs_the_key_the_right_to_move_and_the_pages_own_origin(
    rig: Rig, folder: Path
) -> None:
    url = f"{rig.guarded_url}/procedure"
    assert httpx.post(url, json=COMMISSION).status_code == 401
    assert httpx.get(url).status_code == httpx.delete(url).status_code == 401
    assert httpx.get(f"{url}/curves").status_code == 401
    assert ask(rig, COMMISSION).status_code == 409
    assert ask(rig, COMMISSION, **{"X-Control-Token": "wrong"}).status_code == 409
    assert ask(rig, COMMISSION, Origin="http://elsewhere.example").status_code == 403
    assert not job(rig)["running"]


def test_no_file_but_those_of_a_report_is_served(rig: Rig, folder: Path) -> None:
    secret = folder.parent / "secret.html"
    secret.write_text("of others")
    (folder / "link.html").symlink_to(secret)
    (folder / "raw.bin").touch()
    (folder / "done").touch()
    with in_control(rig) as token:
        ask(rig, COMMISSION, **token)
        until(lambda: not job(rig)["running"])
    root = rig.guarded_url + job(rig)["reports"][0]["path"].rpartition("/")[0]
    for name in ("..%2fsecret.html", "link.html", "raw.bin", "%2fetc%2fpasswd", "", "nothing.html"):
        assert httpx.get(f"{root}/{name}").status_code == 404, name
    assert httpx.get(f"{rig.guarded_url}/reports/guess/report.html").status_code == 404
    headers = httpx.get(f"{root}/report.html").headers
    assert "sandbox" in headers["content-security-policy"]


def test_the_curves_of_a_log_that_is_being_written_are_read(rig: Rig, folder: Path) -> None:
    columns = ["time_s", "setpoint_rad[0]", "position_rad[0]", "torque_actual_Nm[0]"]
    header = {"format": "cdpr-rt raw log", "version": 1, "columns": columns, "period_s": 0.001}
    with in_control(rig) as token:
        ask(rig, COMMISSION, **token)
        until(lambda: job(rig)["steps"])
        raw = folder / "left" / "raw"
        raw.mkdir(parents=True)
        text = json.dumps({**header, "what": "sweep", "rows": None}).encode().ljust(4095) + b"\n"
        rows = b"".join(_row(k) for k in range(50_000))
        (raw / "sweep-0.raw").write_bytes(text + rows + b"half")
        os.utime(raw / "sweep-0.raw", (time.time() + 1, time.time() + 1))
        found = httpx.get(f"{rig.guarded_url}/procedure/curves", headers=RIGHT).json()
    assert found["name"] == "sweep"
    assert 250 < len(found["time_s"]) < 350
    assert found["time_s"][0] == pytest.approx(-30.0, abs=0.2)
    assert found["error_deg"][5] == pytest.approx(57.2958, abs=1e-3)
    assert found["torque_Nm"][5] == 0.5


def _row(k: int) -> bytes:
    return struct.pack("<4d", 1e-3 * k, 2.0, 1.0, 0.5)
