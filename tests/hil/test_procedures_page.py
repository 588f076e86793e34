"""Commissioning, calibration and description by clicks, against a real daemon."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest
import test_operators_page as page_rig
from daemon_rig import RealDaemon
from test_operators_page import playwright_api, press
from waiting import until

from cdpr_profiles import load_robot
from cdpr_profiles.places import SHIPPED

pytestmark = page_rig.pytestmark
browser = page_rig.browser
_PATIENCE_ms = 240e3
_VIEWS = ("commission", "calibrate", "describe")


@pytest.fixture(scope="module")
def home(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a folder for the user's profiles and data."""
    return tmp_path_factory.mktemp("home")


@pytest.fixture(scope="module")
def daemon(home: Path) -> Iterator[RealDaemon]:
    """Run a robot in few cycles, which take less time."""
    robot = home / "slowly-4.toml"
    shipped = (SHIPPED / "robots" / "planar-4.toml").read_text()
    robot.write_text(shipped.replace("sync_period_s = 0.001", "sync_period_s = 0.004"))
    env = {"XDG_CONFIG_HOME": str(home / "config"), "XDG_STATE_HOME": str(home / "state")}
    made = RealDaemon(home, "--no-record", robot=robot, env=env)
    try:
        yield made
    finally:
        assert made.end() == 0, made.errors()


@pytest.fixture
def page(daemon: RealDaemon, browser: playwright_api.Browser) -> Iterator[playwright_api.Page]:
    """Open the page; errors on its console fail the test."""
    context = browser.new_context(
        viewport={"width": 1400, "height": 900}, reduced_motion="reduce", accept_downloads=True
    )
    context.set_default_timeout(_PATIENCE_ms)
    page = context.new_page()
    wrong: list[str] = []
    page.on("pageerror", lambda error: wrong.append(str(error)))
    page.on("console", lambda one: wrong.append(one.text) if "Security" in one.text else None)
    page.goto(str(daemon.http.get("/page-address").json()["url"]))
    yield page
    context.close()
    assert not wrong


def show(page: playwright_api.Page, view: str) -> None:
    page.get_by_role("navigation").get_by_role("link", name=view, exact=True).click()


def test_a_motor_is_commissioned_and_its_report_opens(
    page: playwright_api.Page, daemon: RealDaemon, home: Path
) -> None:
    show(page, "Commission")
    assert page.get_by_role("button", name="Commission", exact=True).is_disabled()
    page.get_by_label("lower left").check()
    page.get_by_label("The cables are off the drums").check()
    press(page, "Commission lower left")
    page.get_by_text("Slow sweeps").wait_for()
    page.get_by_text("Torque, Nm").wait_for()
    page.get_by_text("The procedure is finished.").wait_for()
    page.get_by_role("region", name="Result of lower left").get_by_text("times").first.wait_for()
    with page.expect_popup() as opened:
        page.get_by_role("link", name="Open the report: lower left").click()
    opened.value.get_by_role("heading", name="Commissioning of").first.wait_for()
    folder = home / "state" / "cdpr-rt" / "procedures" / "slowly-4" / "commission"
    assert (folder / "lower-left" / "cogging-profile.json").exists()
    until(lambda: not daemon.status()["control"]["held"])


def test_the_stop_ends_a_procedure_from_any_view(
    page: playwright_api.Page, daemon: RealDaemon
) -> None:
    show(page, "Commission")
    page.get_by_role("button", name="Choose all").click()
    page.get_by_label("The cables are off the drums").check()
    press(page, "Commission upper left, upper right, lower right, lower left")
    page.get_by_role("heading", name="Running").wait_for()
    show(page, "Robot")
    page.keyboard.press("Space")
    show(page, "Commission")
    page.get_by_text("Ended: hold by page").first.wait_for()
    assert daemon.status()["state"] == "ready"


def test_a_winch_is_calibrated_by_tension(page: playwright_api.Page) -> None:
    show(page, "Calibrate")
    press(page, "Winch tension")
    page.get_by_label("Masses, kg").fill("2, five")
    assert page.get_by_role("button", name="Calibrate upper left").is_disabled()
    page.get_by_label("Masses, kg").fill("2, 5, 10")
    press(page, "Calibrate upper left")
    result = page.get_by_role("region", name="Winch", exact=True)
    result.get_by_text("mNm/N").wait_for()
    picture = result.get_by_role("img")
    until(lambda: picture.evaluate("one => one.naturalWidth > 100"))


def test_the_geometry_is_measured_judged_and_adopted(
    page: playwright_api.Page, daemon: RealDaemon
) -> None:
    show(page, "Calibrate")
    press(page, "Geometry")
    assert page.get_by_role("button", name="Measure", exact=True).is_disabled()
    press(page, "Enable")
    press(page, "Tighten")
    page.get_by_label("Poses").fill("20")
    press(page, "Measure")
    verdict = page.get_by_role("region", name="Verdict")
    verdict.get_by_text("Uncertainty, 3 sigma").wait_for()
    page.get_by_role("link", name="Open the report").wait_for()
    assert daemon.status()["program"] == "hold"
    anyway = verdict.get_by_label("Adopt the calibration although its changes are not significant.")
    if anyway.count():
        anyway.check()
        press(page, "Adopt")
        page.get_by_text("takes effect at the next start").first.wait_for()
    press(page, "Power off")
    daemon.wait_for("ready")


def test_a_robot_is_described_diagnosed_and_saved(page: playwright_api.Page, home: Path) -> None:
    show(page, "Describe")
    page.get_by_text("It can work. No problems found.").wait_for()
    mass = page.get_by_role("textbox", name="Mass of the platform (kg)")
    mass.fill("20")
    page.get_by_text("This robot cannot work.").wait_for()
    mass.fill("heavy")
    page.get_by_text("allowed: a number from").wait_for()
    press(page, "Use the default of Mass of the platform (kg)")
    page.get_by_text("It can work. No problems found.").wait_for()
    page.get_by_role("combobox", name="Kind of robot").select_option("planar-4")
    page.get_by_role("textbox", name="Cable 4").first.wait_for()
    for name, wrong in (("../up", True), ("My robot", True), ("mine", False)):
        page.get_by_label("Name of the file").fill(name)
        assert page.get_by_role("button", name="Save").is_disabled() is wrong
    press(page, "Save")
    page.get_by_text("Saved. Try it").wait_for()
    file = home / "config" / "cdpr-rt" / "profiles" / "robots" / "mine.toml"
    assert len(load_robot(file).axes) == 4
    press(page, "Save")
    press(page, "Replace it")
    page.get_by_text("Saved. Try it").wait_for()
    with page.expect_download() as loaded:
        press(page, "Download")
    assert Path(loaded.value.path()).read_text() == file.read_text()
    page.get_by_role("button", name="Start from").click()
    page.get_by_text("It can work").wait_for()


def test_the_views_are_accessible(page: playwright_api.Page) -> None:
    for view in _VIEWS:
        show(page, view.capitalize())
        page.get_by_role("main").get_by_role("heading", level=2).first.wait_for()
        if view == "describe":
            page.get_by_role("combobox", name="Kind of robot").wait_for()
        page_rig.assert_accessible(page)
