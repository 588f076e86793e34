"""The control interface of a real daemon: fuzzing, and failures of service or client."""

from __future__ import annotations

import os
import signal
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path
from typing import Any

import httpx
import pytest
import requests
import schemathesis
from daemon_lab import RIGHT, angles, events, happened, holding, running, with_key, with_power
from daemon_rig import PATIENCE_S, RealDaemon
from hypothesis import HealthCheck, given, settings
from hypothesis.errors import Unsatisfiable
from requests.adapters import HTTPAdapter
from waiting import until

MORE_MEMORY_B = 40e6


@pytest.fixture(scope="module")
def daemon(tmp_path_factory: pytest.TempPathFactory) -> Iterator[RealDaemon]:
    """A daemon that stands still and answers requests, with a slow cycle."""
    folder = tmp_path_factory.mktemp("daemon")
    # requests save robots and procedures
    own = {f"XDG_{name}_HOME": str(folder / name) for name in ("CONFIG", "STATE")}
    with running(folder, *with_key(folder), period_s=0.01, env=own) as one:
        yield one


@pytest.fixture
def url(daemon: RealDaemon) -> str:
    return f"http://{daemon.status()['parts']['service']['http']}"


@pytest.fixture(scope="module")
def description(daemon: RealDaemon) -> Any:
    described = daemon.http.get("/openapi.json").json()
    for operations in described["paths"].values():
        for operation in operations.values():
            del operation["security"]  # each request contains the key
    return schemathesis.openapi.from_dict(described)


FUZZED = settings(max_examples=5, suppress_health_check=list(HealthCheck))


def resident_B(pid: int) -> int:
    pages = int(Path(f"/proc/{pid}/statm").read_text().split()[1])
    return pages * os.sysconf("SC_PAGE_SIZE")


class ConnectsFrom(HTTPAdapter):
    """Connect from `address` of this machine."""

    def __init__(self, address: str) -> None:
        self._address = address
        super().__init__()

    def init_poolmanager(self, *given: Any, **more: Any) -> None:
        super().init_poolmanager(*given, source_address=(self._address, 0), **more)


def fuzz(description: Any, url: str, leave_out: set[str], **headers: str) -> int:
    """Send valid and invalid requests of each kind. Return how many.

    Each comes from a different address, because an address with too many wrong tokens must wait.
    """
    sent = 0
    for found in description.get_all_operations():
        operation = found.ok()
        if operation.path in leave_out:
            continue
        for mode in schemathesis.GenerationMode:

            @FUZZED
            @given(case=operation.as_strategy(generation_mode=mode))
            def try_it(case: schemathesis.Case) -> None:
                nonlocal sent
                sent += 1
                with requests.Session() as session:
                    address = f"127.0.{1 + sent // 250}.{1 + sent % 250}"
                    session.mount("http://", ConnectsFrom(address))
                    case.call_and_validate(
                        base_url=url,
                        session=session,
                        headers={**RIGHT, **headers},
                        timeout=PATIENCE_S,  # the first check of a robot file starts a process
                    )

            if mode is schemathesis.GenerationMode.NEGATIVE:
                with suppress(Unsatisfiable):  # if nothing in the request can be invalid
                    try_it()
            else:
                try_it()
    return sent


def test_each_answer_matches_the_description_and_nothing_gets_power(
    daemon: RealDaemon, description: Any, url: str
) -> None:
    before = angles(daemon)
    sent = fuzz(description, url, {"/shutdown"})
    assert sent > 150
    assert angles(daemon) == pytest.approx(before, abs=3.0)  # within encoder noise
    assert ("state", "active") not in events(daemon)


@pytest.fixture
def active(daemon: RealDaemon) -> Iterator[RealDaemon]:
    with with_power(daemon) as one:
        yield one


def test_no_request_without_the_right_to_move_moves_an_active_robot(
    active: RealDaemon, description: Any, url: str
) -> None:
    service = active.children()["service"]
    memory_B = resident_B(service)
    before = angles(active)
    with holding(active) as headers:
        wrong = {"X-Control-Token": "a" * 24}
        for path in ("/program", "/set", "/enable"):
            answer = active.http.post(path, json={"program": "jog", "wanted": {}}, headers=wrong)
            assert answer.status_code in (409, 422)
        fuzz(
            description,
            url,
            {"/shutdown", "/disable", "/acknowledge", "/events", "/metrics"},
            **wrong,
        )
        assert active.http.put("/control", headers=headers).status_code in (200, 409)
    assert active.status()["program"] == "hold", happened(active)
    assert angles(active) == pytest.approx(before, abs=10.0)
    assert resident_B(service) - memory_B < MORE_MEMORY_B


def test_a_restarted_service_does_not_need_the_key_file(daemon: RealDaemon, url: str) -> None:
    """The launcher keeps the key that it read, and the address remains the same."""
    key_file = daemon.socket.parent / "key"
    text = key_file.read_text()
    key_file.unlink()
    service = daemon.children()["service"]
    os.kill(service, signal.SIGKILL)
    try:
        until(lambda: daemon.children().get("service") not in (None, service))
        address = f"http://{until(daemon.status)['parts']['service']['http']}"
        assert address == url
        wrong = {"Authorization": f"Bearer {text}x"}
        assert httpx.get(f"{address}/events", headers=RIGHT).status_code == 200
        assert httpx.get(f"{address}/events", headers=wrong).status_code == 401
        loop = daemon.children()["loop"]
        held = [path.readlink() for path in Path(f"/proc/{loop}/fd").iterdir()]
        assert not [path for path in held if "cdpr-rt-key" in str(path)]
        assert text not in Path(f"/proc/{loop}/cmdline").read_text()
    finally:
        key_file.touch(mode=0o600)
        key_file.write_text(text)
