"""A tension distribution of the user's own, in simulation."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

import cdpr_rt as cdpr
from cdpr_tools.cli import main

Tensions = Callable[[np.ndarray], object]


class Spread:
    """Pulls with more than the built-in one; `failing` replaces its tensions from a given call."""

    def __init__(self) -> None:
        self.failing: Tensions | None = None
        self.calls, self.fails_at = 0, 10**9

    def __call__(
        self, W: np.ndarray, w: np.ndarray, low: np.ndarray, high: np.ndarray, _: np.ndarray
    ) -> object:
        self.calls += 1
        middle = 0.5 * (low + high)
        null = np.linalg.svd(W)[2][-1]
        t = -np.linalg.pinv(W) @ w
        # one null direction: to the middle of the part of the line that is within bounds
        ends = np.sort((np.array([low, high]) - t) / null, axis=0)
        t = t + 0.5 * (ends[0].max() + ends[1].min()) * null
        assert np.all(np.abs(t - middle) <= middle - low + 1e-6)
        if self.failing is not None and self.calls >= self.fails_at:
            return self.failing(t)
        return t


def raising(_tensions: np.ndarray) -> object:
    raise ZeroDivisionError("no way on")


def test_a_distribution_carries_the_platform_and_stops_the_robot_if_it_fails(
    planar_file: Path,
) -> None:
    mine, place = Spread(), [0.2, 1.8]
    expected = cdpr.load(planar_file, tension_distribution=mine).tensions(place)
    assert expected.min() > cdpr.load(planar_file).tensions(place).min() + 10.0
    mine.calls = 0
    with cdpr.simulate(planar_file, tension_distribution=mine) as robot:
        robot.enable()
        robot.tighten()
        assert mine.calls == 0  # it stands on its stand
        robot.move_to(place)
        robot.wait(1.0)
        assert robot.position_m == pytest.approx(place, abs=0.002)
        assert robot.status["program_progress"]["tension_N"] == pytest.approx(expected, rel=0.1)
        log = robot.log("tension_N")["tension_N"]
        assert np.nanmax(np.abs(np.diff(log, axis=0))) < 30.0  # no step to the distribution
        robot.lower()
        for failing, reason in (
            (raising, "tension distribution Spread: ZeroDivisionError: no way on"),
            (lambda t: 1j * t, r"tension distribution Spread: returned .*j.*; return 3 finite"),
            (lambda t: t + np.eye(3)[0], r"Spread: W t \+ w is .* in row"),
        ):
            mine.failing = None
            robot.enable()
            robot.tighten("home")
            mine.failing, mine.fails_at = failing, mine.calls + 250
            with pytest.raises(cdpr.Faulted, match=reason) as fault:
                robot.move_to(place, speed_m_s=0.1)
            assert fault.value.limit == "not_finite"
            assert mine.calls == mine.fails_at  # it was not asked while the platform came down
            robot.acknowledge()


def test_a_controller_distributes_by_the_robots_distribution(planar_file: Path) -> None:
    class Holding(cdpr.Controller):
        def update(self, state: cdpr.State, target: cdpr.Target) -> np.ndarray:
            error = target.position - state.position
            at_rest, pushing = map(state.distribute, np.array([[0.0, 0.0], [0.0, 5.0]]))
            assert (at_rest != pushing).any()
            return state.distribute(1500.0 * error + 60.0 * (target.velocity - state.velocity))

    mine = Spread()
    with cdpr.simulate(planar_file, controller=Holding(), tension_distribution=mine) as robot:
        robot.enable()
        robot.tighten()
        robot.move_to([0.0, 1.42])
        expected = cdpr.load(planar_file, tension_distribution=Spread()).tensions([0.0, 1.42])
        assert robot.status["program_progress"]["tension_N"] == pytest.approx(expected, abs=15.0)


CODE = """
import numpy as np

def spread(W, w, low, high, previous):
    raise ZeroDivisionError("it has run")
"""


@pytest.fixture
def naming(planar_file: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A robot's file that names code beside it."""
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "state"))
    path = tmp_path / "naming.toml"
    text = planar_file.read_text()
    path.write_text(
        text.replace("[platform]", '[platform]\ntension_distribution = "mine.py:spread"')
    )
    (tmp_path / "mine.py").write_text(CODE)
    return path


def test_a_robots_file_runs_code_only_if_the_user_allows_it(naming: Path) -> None:
    place, key = [0.0, 1.8], "naming.toml: platform.tension_distribution: mine.py:spread: "
    model = cdpr.load(naming)
    assert model.lengths(place).shape == (3,)
    for asking in (lambda: model.tensions(place), lambda: cdpr.simulate(naming)):
        with pytest.raises(cdpr.InvalidRobot, match=f"{key}.*allow it with --allow-code"):
            asking()
    allowed = cdpr.load(naming, allow_code=True)
    for again in (allowed, cdpr.load(naming)):
        with pytest.raises(cdpr.InvalidArgument, match="spread: ZeroDivisionError: it has run"):
            again.tensions(place)
    (naming.parent / "mine.py").write_text(CODE + "\n")
    with pytest.raises(cdpr.InvalidRobot, match=f"{key}.*has changed since you allowed it"):
        cdpr.load(naming).tensions(place)


def test_a_robots_file_may_name_what_an_installed_package_registers(
    naming: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    folder, text = naming.parent, naming.read_text()
    naming.write_text(text.replace("mine.py:spread", "spread"))
    with pytest.raises(cdpr.InvalidRobot, match="value 'spread'; allowed: 'minimum-norm'"):
        cdpr.load(naming)
    info = folder / "of_others-1.0.dist-info"
    info.mkdir()
    (info / "METADATA").write_text("Metadata-Version: 2.1\nName: of-others\nVersion: 1.0\n")
    group = "[cdpr_rt.tension_distributions]\nspread = tensions_of_others:spread\n"
    (info / "entry_points.txt").write_text(group)
    (folder / "tensions_of_others.py").write_text(CODE)
    monkeypatch.syspath_prepend(str(folder))
    with pytest.raises(cdpr.InvalidArgument, match="spread: ZeroDivisionError: it has run"):
        cdpr.load(naming).tensions([0.0, 1.8])


@pytest.mark.parametrize(
    ("options", "text"),
    [
        ([], "mine.py is code that would run with your rights"),
        (["--tension-distribution", "mine.py:missing"], "--tension-distribution mine.py:missing:"),
        (
            ["--tension-distribution", "math:pi"],
            "math:pi: 3.141592653589793 is not a function f(W, w, low,",
        ),
        (["--control", "mine.py:spread", "--allow-code"], "with --tension-distribution"),
    ],
)
def test_a_trial_rejects_code_that_it_cannot_use(
    naming: Path,
    options: list[str],
    text: str,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.chdir(naming.parent)
    monkeypatch.setattr("sys.argv", ["cdpr", "robot", "trial", str(naming), "targets", *options])
    with pytest.raises(SystemExit) as ended:
        main()
    assert ended.value.code == 2
    assert text in " ".join(capsys.readouterr().err.split())
