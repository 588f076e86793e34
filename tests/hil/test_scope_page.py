"""The page's scope, recordings, drives and bus, by clicks in a real Chromium."""

from __future__ import annotations

import csv
from collections.abc import Iterator
from itertools import pairwise
from pathlib import Path
from typing import Any

import pytest
import test_operators_page as page_rig
from daemon_rig import PATIENCE_S, RealDaemon
from test_operators_page import address, opened, press
from waiting import until

from cdpr_rt.service.recording_reader import RecordingReader

pytestmark = page_rig.pytestmark
browser = page_rig.browser
ROBOT = "planar-3"


@pytest.fixture(scope="module")
def daemon(tmp_path_factory: pytest.TempPathFactory) -> Iterator[RealDaemon]:
    folder = tmp_path_factory.mktemp("scope")
    made = RealDaemon(folder, "--record", str(folder / "recordings"), robot=Path(ROBOT))
    try:
        yield made
    finally:
        assert made.end() == 0, made.errors()


def view(page: Any, name: str) -> None:
    page.get_by_role("link", name=name, exact=True).click()


def pick(page: Any, label: str, value: str) -> None:
    page.get_by_role("combobox", name=label, exact=True).select_option(value)


def save(page: Any, name: str, target: Path) -> Path:
    with page.expect_download(timeout=1e3 * PATIENCE_S) as download:
        page.get_by_role("button", name=name, exact=True).first.click()
    download.value.save_as(target)
    return target


def test_the_scope_shows_every_cycle_and_exports_what_it_shows(
    daemon: RealDaemon, browser: Any, tmp_path: Path
) -> None:
    with opened(browser, address(daemon)) as page:
        view(page, "Scope")
        pick(page, "Quantity", "position_rad")
        press(page, "Show only this")
        page.get_by_text("position of lower, rad").first.wait_for()
        pick(page, "Time", "1")
        before = daemon.status()["count"]["cycles"]
        until(lambda: daemon.status()["count"]["cycles"] > before + 1500)
        press(page, "Pause")
        rows = list(csv.reader(save(page, "Export as CSV", tmp_path / "scope.csv").open()))
    assert rows[0] == ["time_s", *(f"position_rad[{name}]" for name in axes_of(daemon))]
    times = [float(row[0]) for row in rows[1:]]
    assert 900 < len(times) < 1100
    assert max(b - a for a, b in pairwise(times)) < 1.5e-3


def axes_of(daemon: RealDaemon) -> list[str]:
    return [axis["name"] for axis in daemon.http.get("/description").json()["axes"]]


def test_a_trigger_catches_one_edge_and_cursors_measure_it(
    daemon: RealDaemon, browser: Any
) -> None:
    with opened(browser, address(daemon)) as page:
        view(page, "Scope")
        pick(page, "Quantity", "state")
        press(page, "Show only this")
        pick(page, "Time", "1")
        pick(page, "Trigger", "edge")
        page.get_by_label("Trigger level").fill("2.5")
        page.get_by_role("checkbox", name="once").check()
        page.get_by_text("Waiting for the trigger").wait_for()
        press(page, "Enable")
        page.get_by_role("button", name="Continue", exact=True).wait_for()
        for number, share in enumerate((0.05, 0.95)):
            slider = page.locator(".slider input").nth(number)
            slider.evaluate(
                "(e, share) => { e.value = +e.min + share * (e.max - e.min);"
                " e.dispatchEvent(new Event('input', { bubbles: true })) }",
                share,
            )
        values = page.get_by_role("region", name="Values at the cursors")
        values.get_by_text("ready", exact=True).wait_for()
        values.get_by_text("active", exact=True).wait_for()
        page.get_by_text("2 to 3").wait_for()
        press(page, "Power off")
        daemon.wait_for("ready")


def test_recordings_are_listed_downloaded_and_plotted(
    daemon: RealDaemon, browser: Any, tmp_path: Path
) -> None:
    with opened(browser, address(daemon)) as page:
        view(page, "Recordings")
        page.get_by_text("being recorded").wait_for()
        copy = save(page, "Download MCAP", tmp_path / "copy.mcap")
        reader = RecordingReader(copy)
        assert sum(one["cycle"].size for one in reader.cycles(["cycle"])) > 1000
        table = save(page, "Download CSV", tmp_path / "table.csv").read_text().splitlines()
        assert len(table) > 1000
        view(page, "Plot")
        page.get_by_text("cycles").filter(has_text="Drag to zoom").wait_for()
        page.get_by_role("link", name="Show live values").click()
        page.get_by_text("Live", exact=True).wait_for()


def test_objects_are_read_and_written_with_consent_without_power_only(
    daemon: RealDaemon, browser: Any
) -> None:
    with opened(browser, address(daemon)) as page:
        view(page, "Drives and bus")
        page.get_by_role("button", name="upper right").click()
        page.get_by_text("Statusword of upper right").wait_for()
        press(page, "Read error, mode, voltage, current")
        page.get_by_role("cell", name="325.000 V").wait_for()
        page.get_by_text("Write an object", exact=True).first.click()
        page.get_by_role("textbox", name="Value", exact=True).fill("300")
        write = page.get_by_role("button", name="Write 6072h:0")
        assert write.is_disabled()
        page.get_by_label("Type 6072 again to agree").fill("6072")
        write.click()
        page.get_by_role("cell", name="4.5000 Nm").wait_for()  # the boot has restored it
        page.get_by_text("object 6072h:0 of axis 1 set to 300").first.wait_for()
        press(page, "Enable")
        page.get_by_text("Remove the power first").wait_for()
        assert write.is_disabled()
        press(page, "Power off")
        daemon.wait_for("ready")
        pick(page, "Of", "lower")
        page.get_by_text("No event names lower.").wait_for()


def test_the_views_are_accessible_and_fit_a_phone(daemon: RealDaemon, browser: Any) -> None:
    with opened(browser, address(daemon)) as page:
        for name in ("Scope", "Recordings", "Drives and bus"):
            view(page, name)
            page.locator(".card").nth(1).wait_for()
            page_rig.assert_accessible(page)
