"""Options that place a path: origin, scale, rotation and mirror."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from cdpr_rt.motion.path_description import PathError
from cdpr_rt.service.http_models import PathFile
from cdpr_tools.client.path_following import plain_name, require_held
from cdpr_tools.errors import BadInputError, WorkFailedError
from cdpr_tools.robots.path_options import PathOptions


@pytest.mark.parametrize("typed", ["foo", "", "1", "1 2 3 4", "nan 0", "0 2e6"])
def test_an_invalid_origin_is_rejected_as_typed(typed: str) -> None:
    with pytest.raises(BadInputError, match=f"--origin {typed}: allowed: 2 or 3 numbers in mm"):
        PathOptions(typed)


def test_ignored_words_must_be_words_of_gcode() -> None:
    assert PathOptions(ignore="s, t m03").ignored() == ["S", "T", "M3"]
    with pytest.raises(BadInputError, match="--ignore M3;S: allowed: words of G-code"):
        PathOptions(ignore="M3;S")


def test_an_origin_may_contain_other_coordinate_systems() -> None:
    settings = PathOptions("1 2 3 g55 4 5 6 G59 7 8 9").settings(3)
    np.testing.assert_allclose(settings.origin_m, [1e-3, 2e-3, 3e-3])
    assert sorted(settings.origins_m) == ["G55", "G59"]
    np.testing.assert_allclose(settings.origins_m["G59"], [7e-3, 8e-3, 9e-3])
    with pytest.raises(BadInputError, match="--origin 1 2 3 G55 4: allowed: 2 or 3 numbers"):
        PathOptions("1 2 3 G55 4")


def test_a_file_is_mirrored_then_turned() -> None:
    options = PathOptions(scale=2.0, rotate_deg=90.0, mirror="x")
    np.testing.assert_allclose(
        options.settings(3).placement @ [1.0, 1.0, 1.0], [-2.0, -2.0, 2.0], atol=1e-12
    )
    assert PathOptions(**options.request()) == options


def test_options_of_gcode_are_rejected_with_way_points() -> None:
    for options in (PathOptions("1 2 3"), PathOptions(scale=2.0), PathOptions(z_mm=1.0)):
        options.require_use(Path("part.nc"))
        with pytest.raises(BadInputError, match="allowed only with G-code; part"):
            options.require_use(Path("part.csv"))
    PathOptions(blend_mm=5.0).require_use(Path("part.csv"))


def test_a_file_of_any_name_gets_a_name_that_the_daemon_accepts(tmp_path: Path) -> None:
    for name in ("part.nc", "Träger (2).NC", "_a.csv", f"{200 * 'long'}.toml", "ü.tap"):
        PathFile(name=plain_name(tmp_path / name), text="")
    assert plain_name(tmp_path / "part 1.nc") == "part 1.nc"
    with pytest.raises(PathError, match=r"README.md: not a path file; allowed: way points"):
        plain_name(tmp_path / "README.md")


@pytest.mark.parametrize(
    ("status", "told"),
    [
        (
            {"state": "ready"},
            "not allowed in state ready; allowed in active; `cdpr enable` switches the power on",
        ),
        ({"state": "fault"}, "not allowed in state fault; .* `cdpr ack` acknowledges it"),
        ({"state": "active", "program_progress": {"tight": False}}, "`cdpr tighten` first"),
    ],
)
def test_a_path_is_not_planned_unless_the_platform_is_held_on_tight_cables(
    status: dict[str, Any], told: str
) -> None:
    with pytest.raises(WorkFailedError, match=told):
        require_held(status)
    require_held({"state": "active", "program_progress": {"tight": True}})


def test_an_origin_in_metres_is_detected() -> None:
    assert "In mm: --origin '300 1700'" in PathOptions("0.3 1.7").metres_hint()
    for typed in ("300 1700", "0 0", "5 10", "-150.5 100 1550", None):
        assert PathOptions(typed).metres_hint() == ""
