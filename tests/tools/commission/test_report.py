"""The report of a synthetic commissioning with known figures."""

from __future__ import annotations

import base64
import copy
import json
import math
import re
import shutil
from html.parser import HTMLParser
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from cdpr_profiles import Winch, load_winch
from cdpr_rt.errors import RawLogError
from cdpr_rt.identification.commissioning_results import Paths, assemble
from cdpr_tools.commission.page import build
from cdpr_tools.errors import BadInputError
from cdpr_tools.recordings.truth import true_angle
from cdpr_tools.rendering import number
from tests.tools.commission.made_up_commissioning import AMPLITUDES_Nm, Commissioned, make_up

FIGURES = ("rms_position_error_deg", "peak_pid_effort_Nm", "peak_velocity_error_deg_s")


class Page(HTMLParser):
    """The resources that a browser would load, and the numbers in each table."""

    def __init__(self, path: Path) -> None:
        super().__init__()
        self.tags: list[str] = []
        self.sources: list[str] = []
        self.links: list[str] = []
        self.tables: list[list[float]] = []
        self.words: list[str] = []
        self.text = path.read_text(encoding="utf-8")
        self.feed(self.text)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.append(tag)
        values = dict(attrs)
        if tag == "img":
            self.sources.append(values["src"] or "")
        self.links += [values[k] or "" for k in ("href", "srcset", "data") if k in values]
        if tag == "table":
            self.tables.append([])
        if tag == "data":
            self.tables[-1].append(float(values["value"] or "nan"))

    def handle_data(self, data: str) -> None:
        self.words.append(data)

    @property
    def plain(self) -> str:
        return " ".join(" ".join(self.words).split())


@pytest.fixture(scope="module")
def commissioned(tmp_path_factory: pytest.TempPathFactory) -> Commissioned:
    return make_up(tmp_path_factory.mktemp("thorough"), True, (8.0, 4.0))


@pytest.fixture(scope="module")
def quick(tmp_path_factory: pytest.TempPathFactory) -> Commissioned:
    return make_up(tmp_path_factory.mktemp("quick"), False, (8.0,))


@pytest.fixture(scope="module")
def winch() -> Winch:
    return load_winch("winch-mpp0923d")


def assembled(made: Commissioned, paths: Paths | None = None) -> dict[str, Any]:
    paths = paths or made.paths
    return assemble(paths, made.run, made.found, true_angle(paths.truth))


@pytest.fixture(scope="module")
def results(commissioned: Commissioned) -> dict[str, Any]:
    return assembled(commissioned)


@pytest.fixture(scope="module")
def page(commissioned: Commissioned, winch: Winch, results: dict[str, Any]) -> Page:
    build(commissioned.paths, winch, results, commissioned.found)
    return Page(commissioned.paths.page)


def test_the_page_loads_no_other_resource(page: Page) -> None:
    assert not {"script", "link", "iframe", "object", "base"} & set(page.tags)
    assert not page.links
    assert not re.search(r"https?://|url\(|@import|srcset", page.text)
    assert len(page.sources) == page.tags.count("img") == 10
    for source in page.sources:
        head, body = source.split(",", 1)
        assert head == "data:image/png;base64"
        assert base64.b64decode(body, validate=True).startswith(b"\x89PNG")
    assert len(page.text) < 2_500_000
    assert 'name="viewport"' in page.text
    assert "@media print" in page.text
    assert "a <drive> & more" in page.plain  # names are escaped and not read as tags


def test_the_table_shows_the_figures_of_the_json(commissioned: Commissioned, page: Page) -> None:
    stored = json.loads(commissioned.paths.results.read_text())["validation"]
    assert not list(commissioned.paths.out.glob("*.part"))
    wanted = []
    for key in FIGURES:
        ratio = key.rsplit("_deg", 1)[0].removesuffix("_Nm")
        wanted += [stored["none"][key]]
        for method in ("thesis", "harmonic"):
            wanted += [stored[method][key], stored[method]["ratios"][ratio]]
        wanted += [stored["floor"][key]]
    assert page.tables[0] == wanted
    for value in wanted:
        assert f">{number(value)}</data>" in page.text
    # and the figures are those of the synthetic recordings
    assert wanted[0] == pytest.approx(4.0 / math.sqrt(2.0), rel=1e-3)
    assert stored["harmonic"]["ratios"]["rms_position_error"] == pytest.approx(20.0, rel=0.01)
    assert stored["thesis"]["ratios"]["peak_pid_effort"] == pytest.approx(8.0, rel=0.01)


def test_the_encoder_table_differs_from_the_true_one(results: dict[str, Any], page: Page) -> None:
    judged = results["validation"]["encoder"]
    table = next(one for one in page.tables[1:] if judged["none"][FIGURES[0]] in one)
    assert judged["harmonic"][FIGURES[2]] in table
    assert judged["harmonic"][FIGURES[2]] != results["validation"]["harmonic"][FIGURES[2]]


def test_harmonics_and_margins_are_reported(results: dict[str, Any], page: Page) -> None:
    amplitudes = [1e3 * one for one in AMPLITUDES_Nm.values()]
    assert amplitudes in page.tables
    assert "cause of 24" in page.plain
    design = results["pid"][0]
    assert f"phase margin {number(design['phase_margin_deg'])} deg" in page.plain
    assert f"gain margin {number(design['gain_margin_dB'])} dB" in page.plain
    assert f"peak of the sensitivity {number(design['sensitivity_peak'])}" in page.plain
    assert "order 4 with 4.0 mNm is the largest part" in page.plain
    assert (
        "2.8 mNm rms come back at the same angle" in page.plain
    )  # 4 mNm divided by the square root of 2


def test_the_verdict_follows_the_targets(
    commissioned: Commissioned, winch: Winch, results: dict[str, Any], tmp_path: Path
) -> None:
    paths = copy_of(commissioned, tmp_path)
    harder = copy.deepcopy(results)
    harder["validation"]["targets"]["harmonic"]["peak_pid_effort"] = 21.0
    harder["validation"]["targets"]["thesis"]["rms_position_error"] = 99.0
    build(paths, winch, harder, commissioned.found)
    told = Page(paths.page)
    assert 'class="verdict missed"' in told.text
    assert "not reached in the peak PID effort." in told.plain
    assert "RMS position error 4.44 times smaller instead of 99" in told.plain
    assert "The reasons:" in told.plain
    assert "99 asked: missed" in told.plain
    easier = copy.deepcopy(results)
    for goals in easier["validation"]["targets"].values():
        goals.update(dict.fromkeys(goals, 2.0))
    build(paths, winch, easier, commissioned.found)
    told = Page(paths.page)
    assert 'class="verdict"' in told.text
    assert "asked: missed" not in told.plain
    assert told.plain.count("2, 2 and 2 were asked: all reached.") == 2
    assert "falls short" not in told.plain


def test_a_report_with_one_direction_and_one_bandwidth_says_so(
    quick: Commissioned, winch: Winch
) -> None:
    build(quick.paths, winch, assembled(quick), quick.found)
    told = Page(quick.paths.page)
    assert len(told.sources) == 9
    assert "one bandwidth only" in told.plain
    assert "come back at the same angle" not in told.plain  # without an earlier turn for comparison


def test_a_real_motor_is_judged_by_its_encoder(
    quick: Commissioned, winch: Winch, tmp_path: Path
) -> None:
    paths = copy_of(quick, tmp_path)
    paths.truth.unlink()
    build(paths, winch, assembled(quick, paths), quick.found)
    told = Page(paths.page)
    assert "Judged on the encoder" in told.plain
    assert "true angle, from" not in told.plain
    assert "Deviation of the angle on the encoder" in told.plain
    assert "as a real motor is" not in told.plain


def copy_of(made: Commissioned, folder: Path) -> Paths:
    shutil.copytree(made.paths.out, folder, dirs_exist_ok=True)
    for name in ("report.html", "report.json"):
        (folder / name).unlink(missing_ok=True)
    return Paths(folder)


def test_missing_and_damaged_recordings_are_named(
    quick: Commissioned, winch: Winch, tmp_path: Path
) -> None:
    results = assembled(quick)
    paths = copy_of(quick, tmp_path)
    one = paths.raw("validate-8Hz-thesis-0")
    whole = one.read_bytes()
    one.unlink()
    with pytest.raises(
        BadInputError, match=r"validate-8Hz-thesis-0\.raw: the recording is missing"
    ):
        build(paths, winch, results, quick.found)
    one.write_bytes(whole[:3000])
    with pytest.raises(RawLogError, match=r"validate-8Hz-thesis-0\.raw"):
        build(paths, winch, results, quick.found)
    one.write_bytes(whole)
    paths.truth.write_bytes(paths.truth.read_bytes()[:5000])
    with pytest.raises(BadInputError, match="SYNC"):
        build(paths, winch, results, quick.found)
    assert not paths.page.exists()


@given(st.floats(allow_nan=False, allow_infinity=False, width=32), st.integers(2, 5))
def test_numbers_keep_their_significant_digits(value: float, digits: int) -> None:
    text = number(value, digits).replace("−", "-").replace("\u202f", "")
    assert float(text) == pytest.approx(value, rel=0.51 * 10.0 ** (1 - digits))


def test_missing_and_infinite_numbers_are_shown_as_a_dash() -> None:
    assert number(None) == number(math.inf) == number(np.nan) == "–"
