"""The terminal view of teleoperation."""

from __future__ import annotations

import math
from typing import Any

import pytest
from rich.console import Console

from cdpr_rt.core.states import LoopState
from cdpr_rt.service.stream_client import StreamClient
from cdpr_rt.service.stream_packet import (
    UNKNOWN_POSE,
    Standing,
    StreamAnswer,
    StreamSession,
)
from cdpr_tools.teleop import view as view_module
from cdpr_tools.teleop.input_device import InputSample
from cdpr_tools.teleop.script import ScriptDevice, ScriptLine
from cdpr_tools.teleop.session import TeleopSession
from cdpr_tools.teleop.view import Canvas, View

PLATFORM = {
    "home_m": [0.0, 0.0],
    "exit_points_m": [[-2.0, 2.0], [2.0, 2.0], [0.0, -2.0]],
    "anchor_points_m": [[-0.1, 0.1], [0.1, 0.1], [0.0, -0.1]],
    "workspace_min_m": [-1.0, -1.0],
    "workspace_max_m": [1.0, 1.0],
}
AXES = [{"name": name} for name in ("left", "right", "lower")]


def seen(
    pose: tuple[float, ...],
    status: dict[str, Any],
    platform: dict[str, Any] | None = PLATFORM,
    height: int = 40,
    before: str = "",
    silent_s: float = 0.0,
    coordinates: int = 2,
) -> list[str]:
    """Return the lines shown for a robot that has answered once."""
    with StreamClient("127.0.0.1", 9, StreamSession(1, bytes(32))) as stream:
        stream.state = StreamAnswer(
            1, Standing.ACCEPTED, 1, 0, 0, LoopState.ACTIVE, 3, pose=pose, pose_setpoint=pose
        )
        hand = ScriptDevice((ScriptLine(0.0, (0.0, 0.0, 0.0)),))
        session = TeleopSession(stream, hand, 8.0, 3, coordinates)
        session.leading = True
        session.hand = InputSample((0.01, 0.0, 0.0), clutch=False, confirmed=2)
        session.round_trips_s.extend((0.35, 0.73))
        session._heard_s -= silent_s
        view = View(session, {"axes": AXES, "platform": platform}, before)
        view.tell(status)
        console = Console(width=120, height=height, color_system=None)
        with console.capture() as shown:
            console.print(view)
    return shown.get().splitlines()


def test_the_picture_shows_robot_and_target_at_their_positions() -> None:
    turn = math.radians(1.5)
    pose = (0.5, 0.5, 0.0, math.cos(turn), 0.0, 0.0, math.sin(turn))
    axes = [{"tension_N": 40.4}, {"tension_N": None}, {"tension_N": 20.0}]
    progress = {"target_m": [-0.5, 0.5], "held_back": "left: 12 N are missing", "stream": "fresh"}
    lines = seen(pose, {"axes": axes, "program_progress": progress, "reason": "a reason"})
    text = "\n".join(lines)
    picture = lines[:22]
    assert sum(line.count("◉") for line in picture) == 3
    (row_o, column_o), (row_t, column_t) = (
        next((k, line.index(mark)) for k, line in enumerate(picture) if mark in line)
        for mark in "o+"
    )
    assert row_o == row_t  # same height
    # 1 m of 4.2 m in 22 rows of 4 dots, with 2 dots per character
    assert column_o - column_t == pytest.approx(1.0 * 22 * 4 / 4.2 / 2, abs=1.5)
    for told in (
        "ROBOT FOLLOWS  active, 2 confirmed",
        "platform +500.0 +500.0 mm, +3.00 deg; target -500.0 +500.0 mm",
        "hand +10.0 +0.0 mm times 8; round trip 730.0 ms (at most 730.0 in 2 s)",
        "left 40, right -, lower 20",
        "left: 12 N are missing",
        "a reason",
        "a script moves the hand",
    ):
        assert told in text


def test_stale_values_are_not_shown_as_current(monkeypatch: pytest.MonkeyPatch) -> None:
    pose = (0.5, 0.5, 0.0, 1.0, 0.0, 0.0, 0.0)
    status = {"axes": [{"tension_N": 40.4}], "reason": "held long ago"}
    text = "\n".join(seen(pose, status, before="held long ago"))
    assert "left 40" in text and "held" not in text
    assert "held long ago" in "\n".join(seen(pose, status, before="another"))
    monkeypatch.setattr(view_module, "_STALE_S", 0.0)
    assert "left 40" not in "\n".join(seen(pose, status))
    lines = seen(pose, {}, silent_s=1.2, height=12)
    assert lines[0].startswith("NO ANSWER for 1.2 s")


def test_a_slow_simulation_is_shown() -> None:
    slow = "the simulation runs at 0.40 of real time"
    for factor, shown in ((0.4, True), (0.95, False), (None, False)):
        assert (slow in seen(UNKNOWN_POSE, {"real_time_factor": factor})) is shown


def test_a_small_terminal_shows_the_figures_before_the_picture() -> None:
    pose = (0.5, 0.5, 0.0, 1.0, 0.0, 0.0, 0.0)
    lines = seen(pose, {}, height=24)
    assert len(lines) <= 24
    assert any("◉" in line for line in lines)
    assert not any("◉" in line for line in seen(pose, {}, height=12))


def test_a_robot_without_picture_shows_figures_only() -> None:
    lines = seen(UNKNOWN_POSE, {}, platform=None)
    assert lines[0].startswith("ROBOT FOLLOWS")
    assert not any("platform" in line or "◉" in line for line in lines)


def test_lines_and_marks_are_drawn_at_their_positions() -> None:
    canvas = Canvas(4, 2, (0.0, 0.0), (7.0, 7.0))
    canvas.line((0.0, 7.0), (7.0, 7.0))
    canvas.line((0.0, 0.0), (0.0, 7.0))
    canvas.line((-1e9, math.nan), (1.0, 1.0))  # not finite: omitted
    canvas.mark((6.9, 0.1), "x", "red")
    canvas.mark((70.0, 0.0), "y", "red")
    rows = ["".join(letters for letters, _ in row) for row in canvas.rows()]
    assert rows == ["⡏⠉⠉⠉", "⡇  x"]


def test_all_coordinates_and_the_rotation_are_shown_in_space() -> None:
    half = math.radians(5.0)
    pose = (0.5, 0.25, 1.5, math.cos(half), 0.0, -math.sin(half), 0.0)
    room = {"home_m": [0.0, 0.0, 1.0]}
    progress = {"target_m": [0.5, 0.25, 1.6]}
    lines = seen(pose, {"axes": [], "program_progress": progress}, room, coordinates=3)
    assert any(
        "platform +500.0 +250.0 +1500.0 mm, +0.00 -10.00 +0.00 deg; target +500.0 +250.0 +1600.0"
        in line
        for line in lines
    )
    assert any("hand +10.0 +0.0 +0.0 mm times 8" in line for line in lines)
