"""Programs of the user's own, in simulation."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path

import numpy as np
import pytest

import cdpr_rt as cdpr
from cdpr_rt.errors import ControlError
from cdpr_rt.programs.own_program import checked_programs
from tests.slower_robot import slower_robot

Failing = Callable[[float], object]


class Swing(cdpr.Program):
    """To and fro along x."""

    name = "swing"
    arguments: Mapping[str, tuple[float, float, float]] = {
        "amplitude_m": (0.0, 1.0, 0.05),
        "rate_rad_s": (0.1, 100.0, 3.0),
    }
    failing: Failing | None = None

    def begin(self, position: np.ndarray, amplitude_m: float, rate_rad_s: float) -> None:
        if amplitude_m == rate_rad_s:
            raise ZeroDivisionError("begin")
        self.start, self.amplitude_m, self.rate = position, amplitude_m, rate_rad_s
        self.shift_m = 0.02

    def target(self, time_s: float) -> object:  # type: ignore[override]
        if self.failing is not None and time_s > 0.2:
            return self.failing(time_s)
        if self.rate * time_s > 2.0 * np.pi:
            return None
        side_m = self.shift_m + self.amplitude_m * np.sin(self.rate * time_s)
        return self.start + np.array([side_m, 0.0])


REGISTERED = """
import cdpr_rt as cdpr

class Wait(cdpr.Program):
    name = "wait"

    def target(self, time_s):
        return [0.0, 1.6] if time_s < 0.1 else None
"""


@pytest.fixture
def robot(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> cdpr.Robot:
    """The shipped robot with slow cycles, which take less time, and a package's program."""
    info = tmp_path / "of_others-1.0.dist-info"
    info.mkdir()
    (info / "METADATA").write_text("Metadata-Version: 2.1\nName: of-others\nVersion: 1.0\n")
    (info / "entry_points.txt").write_text("[cdpr_rt.programs]\nwait = programs_of_others:Wait\n")
    (tmp_path / "programs_of_others.py").write_text(REGISTERED)
    monkeypatch.syspath_prepend(str(tmp_path))
    return cdpr.simulate(slower_robot(tmp_path, "planar-3"), programs=[Swing()])


def raising(_time_s: float) -> object:
    raise ZeroDivisionError("no way on")


@pytest.mark.filterwarnings("ignore:the platform stands")
def test_a_program_moves_the_platform_and_holds_it_if_it_fails(
    robot: cdpr.Robot, monkeypatch: pytest.MonkeyPatch
) -> None:
    with robot:
        assert list(robot.description["programs"])[-2:] == ["swing", "wait"]
        described = robot.description["own_programs"]["swing"]
        assert described["text"] == "To and fro along x."
        assert described["arguments"]["amplitude_m"] == {"low": 0.0, "high": 1.0, "default": 0.05}
        robot.enable()
        with pytest.raises(cdpr.Refused, match="swing: the cables are not tight"):
            robot.run("swing")
        robot.tighten()
        robot.move_to([0.0, 1.6])
        for arguments, text in (
            ({"amplitude_m": 2.0}, "amplitude_m: value 2.0; allowed: a number from 0 to 1"),
            ({"amplitude": 0.2}, "key 'amplitude'; allowed: amplitude_m, rate_rad_s"),
            ({"amplitude_m": 1.0, "rate_rad_s": 1.0}, "swing: ZeroDivisionError: begin"),
        ):
            with pytest.raises(cdpr.Refused, match=text):
                robot.run("swing", **arguments)
        robot.run("swing", amplitude_m=0.1)
        log = robot.log("program", "pose", "pose_setpoint")
        swung = log[log["program"] == list(robot.description["programs"]).index("swing")]
        x_m = swung["pose"][:, 0]
        assert x_m.max() == pytest.approx(0.12, abs=0.01)
        assert x_m.min() == pytest.approx(-0.08, abs=0.01)
        assert np.abs(swung["pose"][:, :2] - swung["pose_setpoint"][:, :2]).max() < 0.01
        assert robot.status["program_progress"]["time_s"] == pytest.approx(2.1, abs=0.2)
        robot.run("wait")
        assert robot.position_m == pytest.approx([0.0, 1.6], abs=0.003)
        for failing, text in (
            (
                raising,
                r"swing: at 0\.20\d s: ZeroDivisionError: no way on \(test_own_programs.py:\d+\)",
            ),
            (lambda _: [np.nan, 0.0], r"target returned \[nan  ?0\.\]; return finite numbers, "),
            (lambda _: [0.0, 1.6, 0.0], "return finite numbers, .2,."),
            (lambda _: [0.7, 1.6], r"its target: x 700 mm; allowed: -600 to 600 mm"),
        ):
            monkeypatch.setattr(Swing, "failing", staticmethod(failing))
            with pytest.raises(cdpr.MotionEnded, match=text):
                robot.run("swing", rate_rad_s=5.0)
            robot.wait(0.3)
            assert (robot.state, robot.program) == ("active", "hold")


@pytest.mark.filterwarnings("ignore:the platform stands")
def test_time_waits_for_a_target_that_is_too_fast(robot: cdpr.Robot) -> None:
    with robot:
        robot.enable()
        robot.tighten()
        robot.move_to([0.0, 1.6])
        started_s = robot.time_s
        robot.run("swing", amplitude_m=0.4, rate_rad_s=30.0)  # 12 m/s
        assert robot.time_s - started_s > 2.0
        log = robot.log("time_s", "pose")
        x_m = log["pose"][log["time_s"] > started_s, 0]
        assert x_m.max() > 0.2 and x_m.min() < -0.2
        speed_m_s = np.diff(x_m) / 0.004
        assert np.abs(speed_m_s).max() < 0.6


def test_an_object_that_is_no_program_or_distribution_is_rejected() -> None:
    with pytest.raises(cdpr.InvalidArgument, match=r"programs\[0\]: is not a program; derive it"):
        cdpr.simulate("planar-3", programs=[Swing])  # type: ignore[list-item]
    for wrong in ("mine.py:spread", Swing):
        for use in (cdpr.simulate, cdpr.load):
            with pytest.raises(cdpr.InvalidArgument, match="is not a function f"):
                use("planar-3", tension_distribution=wrong)  # type: ignore[operator]


class Named(Swing):
    def __init__(self, name: object, arguments: object = None) -> None:
        self.name = name  # type: ignore[assignment]
        if arguments is not None:
            self.arguments = arguments  # type: ignore[assignment]


@pytest.mark.parametrize(
    ("program", "text"),
    [
        (Swing, "mine: is not a program; derive it from cdpr_rt.Program"),
        (Named("pose"), "mine: name: 'pose' is taken"),
        (Named("Big Swing"), "mine: name: 'Big Swing'; allowed: small letters"),
        (Named(None), "mine: name: None; allowed"),
        (Named("other", {"x-y": (0.0, 1.0, 0.5)}), "mine: arguments: 'x-y'"),
        (Named("other", {"x": (0.0, 1.0)}), "mine: arguments: 'x': .*lowest, highest, default"),
        (Named("other", {"x": (0.0, 1.0, 2.0)}), "mine: arguments: 'x'"),
        (Named("other", {"x": ("a", "c", "b")}), "mine: arguments: 'x'"),
        (Named("other", {"x": [[1.0], [2.0, 3.0]]}), "mine: arguments: 'x'"),
        (Named("other", {"x": (0.0, float("inf"), 1.0)}), "mine: arguments: 'x': .*three finite"),
        (Named("other", {5: (0.0, 1.0, 0.5)}), "mine: arguments: 5"),
        (Named("other", ["x"]), r"mine: arguments: \['x'\]; give a dictionary"),
    ],
)
def test_an_unsuitable_program_is_named_with_its_reference(program: object, text: str) -> None:
    with pytest.raises(ControlError, match=text):
        checked_programs([("mine", program)], ["hold", "pose"])
