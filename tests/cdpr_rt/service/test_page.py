"""The operator's page is served to everybody; its key, and simulated faults, are not."""

from __future__ import annotations

import json
import re
from pathlib import Path

import httpx
import pytest

from tests.cdpr_rt.service.service_rig import KEY, Rig

RIGHT = {"Authorization": f"Bearer {KEY.decode()}"}
BUILT = Path(__file__).parents[3] / "cdpr_rt" / "page" / "built"


@pytest.fixture(params=["url", "guarded_url"])
def url(rig: Rig, request: pytest.FixtureRequest) -> str:
    return str(getattr(rig, request.param))


def test_every_built_file_is_served_without_the_key(url: str) -> None:
    for file in BUILT.iterdir():
        path = "/" if file.name == "index.html" else f"/page/{file.name}"
        answer = httpx.get(f"{url}{path}")
        assert (answer.status_code, answer.content) == (200, file.read_bytes())
        assert answer.headers["x-content-type-options"] == "nosniff"


@pytest.mark.parametrize("name", ["..%2f..%2frobot.py", "page.js.map", "nothing", "%00"])
def test_nothing_but_the_built_files_is_served(url: str, name: str) -> None:
    assert httpx.get(f"{url}/page/{name}").status_code == 404


def test_the_page_may_run_no_foreign_and_no_inline_script(url: str) -> None:
    policy = httpx.get(url).headers["content-security-policy"]
    assert policy.startswith("default-src 'none'; script-src 'self';")
    assert "unsafe" not in policy
    assert "frame-ancestors 'none'" in policy
    page = (BUILT / "index.html").read_text()
    assert re.findall(r"<script(?![^>]*\bsrc=)|<style|\bon\w+=|https?://", page) == []


@pytest.mark.parametrize(
    ("method", "path", "status"),
    [
        ("GET", "/status", 200), ("GET", "/description", 401), ("GET", "/page/nothing", 404),
        ("GET", "/reports/guess/report.html", 404), ("PATCH", "/status", 405),
        ("POST", "/hold", 422),
    ],
)  # fmt: skip
def test_every_answer_forbids_scripts_frames_and_other_origins(
    rig: Rig, method: str, path: str, status: int
) -> None:
    headers = RIGHT if status in (405, 422) else {}
    answer = httpx.request(method, rig.guarded_url + path, json={"client": ""}, headers=headers)
    assert answer.status_code == status
    assert answer.headers["content-security-policy"].startswith("default-src 'none'")
    assert answer.headers["cross-origin-resource-policy"] == "same-origin"
    assert answer.headers["referrer-policy"] == "no-referrer"


def test_the_built_page_is_small_and_has_its_licences() -> None:
    files = list(BUILT.iterdir())
    assert sum(file.stat().st_size for file in files) < 1.5e6
    licences = (BUILT / "licences.txt").read_text()
    package = json.loads((BUILT.parent / "package.json").read_text())
    for name, version in package["dependencies"].items():
        assert f"{name} {version}\n" in licences


def test_the_address_with_the_key_is_given_on_the_unix_socket_only(rig: Rig, url: str) -> None:
    rig.service.page_url = "http://127.0.0.1:8400/#key=secret"
    assert rig.client().get("/page-address").json() == {"url": rig.service.page_url}
    answer = httpx.get(f"{url}/page-address", headers=RIGHT)
    assert answer.status_code == 403
    assert "secret" not in answer.text


def test_without_a_page_its_address_is_refused_with_the_reason(rig: Rig) -> None:
    rig.service.page_url = ""
    answer = rig.client().get("/page-address")
    assert answer.status_code == 404
    assert "--no-page" in answer.json()["error"]


def test_real_drives_cannot_be_broken_on_request(rig: Rig) -> None:
    body = {"axis": 0, "fault": "cut-cable"}
    answer = httpx.post(f"{rig.guarded_url}/simulated-fault", json=body, headers=RIGHT)
    assert answer.status_code == 404
    assert "simulated" in answer.json()["error"]


def test_a_simulated_fault_needs_the_key_and_is_an_event(rig: Rig) -> None:
    asked: list[tuple[int, str]] = []
    rig.service.inject = lambda axis, fault: asked.append((axis, fault)) or "left: cut-cable"  # type: ignore[func-returns-value]
    body = {"axis": 1, "fault": "cut-cable", "client": "maria"}
    try:
        assert httpx.post(f"{rig.guarded_url}/simulated-fault", json=body).status_code == 401
        answer = httpx.post(f"{rig.guarded_url}/simulated-fault", json=body, headers=RIGHT)
    finally:
        rig.service.inject = None
    assert answer.json() == {"text": "left: cut-cable"}
    assert asked == [(1, "cut-cable")]
    assert rig.service.events.since()[-1]["text"] == "left: cut-cable by maria"
