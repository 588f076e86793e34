"""The status of a daemon as text."""

from __future__ import annotations

import time
from typing import Any

import pytest

from cdpr_profiles import load_robot
from cdpr_tools.client.motion import Outcome, finish
from cdpr_tools.client.status_text import (
    ProgressNotes,
    after_stop_text,
    compensation_text,
    death_text,
    learnt_text,
    next_steps,
    stage_text,
    status_text,
)
from cdpr_tools.errors import WorkFailedError
from cdpr_tools.output import Output
from tests.profiles.test_geometry_calibration import calibration


def status_of(**keys: Any) -> dict[str, Any]:
    return {
        "robot": "bench",
        "state": "ready",
        "program": None,
        "read_only": False,
        "lockstep": False,
        "reason": "",
        "notices": [],
        "axes": [{"name": "left"}],
        "calibration": None,
        "cycle": None,
        "control": {"held": False},
        "loop": {"silent_s": 0.0},
        "parts": {},
        **keys,
    }


LOWERED: dict[str, Any] = {"fallen": False, "broken": []}
FALLEN: dict[str, Any] = {"fallen": True, "broken": ["left: broken"]}
LOOSE: dict[str, Any] = {"program": "hold", "program_progress": {"tight": False}}
LOWERING: dict[str, Any] = {"program": "lower", "program_progress": {"done": 0.0}}
SET_DOWN: dict[str, Any] = {"program": "lower", "program_progress": {"done": 1.0}}
NOT_TIGHTENED: dict[str, Any] = {
    "program": "tighten",
    "program_progress": {"tight": False, "trouble": "left: stuck"},
}
TIGHT: dict[str, Any] = {"program": "hold", "program_progress": {"tight": True}}
SIMULATED = {"can0": {"url": "simbus:own-1-can0"}}


@pytest.mark.parametrize(
    ("disagree_m", "told"),
    [(0.00034, ", whose lengths agree within 0.3 mm"), (0.0, ""), (None, "")],
    ids=["eight cables", "none redundant", "not known"],
)
def test_a_held_platform_shows_how_well_its_lengths_agree(
    disagree_m: float | None, told: str
) -> None:
    status = status_of(state="active", program_progress={"tight": True})
    status["cycle"] = {
        "cycle": 1, "time_s": 0.1, "exchange_s": 0.0, "compute_s": 0.0, "missed": 0,
        "late_cycles": 0, "lengths_disagree_m": disagree_m,
    }  # fmt: skip
    assert f"held by its cables{told}" in [str(line) for line in status_text(status)]


def test_the_calibration_in_force_is_shown_with_its_accuracy() -> None:
    shown = [str(line) for line in status_text(status_of())]
    assert not any("calibration" in line for line in shown)
    known = calibration(load_robot("planar-4")).model_copy(
        update={"predicted_3_sigma_deg": 0.12, "absolute_3_sigma_mm": 14.6}
    )
    shown = [str(line) for line in status_text(status_of(calibration=known.summary()))]
    (line,) = (line for line in shown if "calibration" in line)
    assert line.startswith(f"calibration 1 ({known.identity}) of 2026-03-04 05:06 UTC is in force")
    for figure in (
        "0.50 mm",
        "0.120 deg",
        "absolute positions are uncertain by 14.6 mm",
        "3 sigma",
    ):
        assert figure in line


def test_bus_counters_are_shown() -> None:
    counts = {"transmit_queue_full": 3, "bus_off": 1}
    buses = {
        "can0": {"url": "socketcan:can0", "state": "", "counts": {}},
        "can1": {"url": "socketcan:can1", "state": "bus-off: bus error", "counts": counts},
    }
    lines = [str(line) for line in status_text(status_of(buses=buses))]
    assert [line for line in lines if line.startswith("bus ")] == [
        "bus can1: transmit queue full 3 times, bus off 1 times; bus-off: bus error"
    ]


def test_a_starting_loop_shows_notices_but_no_axes() -> None:
    """Names of axes are not known yet. Notices report the compilation."""
    notices = ["compiling the control loop: 20 kernels so far"]
    lines = status_text(status_of(state="starting", notices=notices, axes=[{"name": None}] * 3))
    assert [str(line) for line in lines] == ["bench: starting", f"note: {notices[0]}"]
    shown = status_text(status_of(axes=[{"name": "left"}]))
    assert str(shown[-1]).startswith("axis ")


def test_the_holder_of_the_right_to_move_is_shown() -> None:
    held = status_text(status_of(control={"held": True, "client": "hand"}))
    assert "the right to move: hand" in [str(line) for line in held]


def test_cables_under_tension_but_not_tight_are_not_reported_as_loose() -> None:
    status = status_of(state="active", program="hold", program_progress={"tight": False})
    status["axes"] = [{"name": "left", "tension_N": N} for N in (0.4, 65.7)]
    lines = [str(line) for line in status_text(status)]
    assert "cables not tight, tensions up to 66 N, power on" in lines
    status["axes"][1]["tension_N"] = None
    lines = [str(line) for line in status_text(status)]
    assert "cables loose, power on" in lines


@pytest.mark.parametrize(
    ("status", "told"),
    [
        ({"state": "ready"}, ["`cdpr enable`"]),
        ({"state": "fault"}, ["remove the cause", "`cdpr ack`, `cdpr enable`"]),
        ({"state": "fault", "reacting": "quick stop"}, []),
        ({"state": "inactive", "reason": "no boot"}, ["remove the cause, then `cdpr check`"]),
        ({"state": "unconfigured", "reason": "a procedure runs", "released": True}, []),
        ({"state": "active"}, []),
        ({"state": "ready", "last_stop": LOWERED}, ["`cdpr enable`, `cdpr tighten`"]),
        ({"state": "active", "last_stop": LOWERED, **LOOSE}, ["`cdpr tighten`"]),
        ({"state": "active", "last_stop": LOWERED, **TIGHT}, []),
        ({"state": "active", "last_stop": LOWERED, **LOWERING}, []),
        ({"state": "active", "last_stop": LOWERED, **SET_DOWN}, ["`cdpr tighten`"]),
        (
            {"state": "active", "last_stop": LOWERED, **NOT_TIGHTENED},
            ["remove the cause", "`cdpr tighten`"],
        ),
        (
            {"state": "fault", "last_stop": LOWERED | {"broken": ["left: broken"]}},
            ["repair the cable", "`cdpr ack`, `cdpr enable`, `cdpr tighten --from home`"],
        ),
        (
            {"state": "ready", "last_stop": FALLEN, "buses": SIMULATED},
            [
                "repair the cable; if it was injected: `cdpr sim fault bench mend`",
                "`cdpr enable`",
                "`cdpr sim fault bench put-back` carries the platform back to its start pose",
                "look at the platform, which has come down; if it stands at home, upright: "
                "`cdpr tighten --from home`",
            ],
        ),
    ],
)
def test_the_steps_until_a_robot_can_move_are_listed(
    status: dict[str, Any], told: list[str]
) -> None:
    lines = [str(line) for line in status_text(status_of(**status))]
    begin = next((i for i, line in enumerate(lines) if line.startswith("next: ")), -1)
    steps = lines[begin : begin + len(told)] if told else []
    assert [step.removeprefix("next: ").strip() for step in steps] == told
    assert bool(told) == (begin >= 0)


def test_a_fallen_platform_with_known_lengths_may_be_tightened_elsewhere() -> None:
    status = status_of(state="active", last_stop=LOWERED | {"fallen": True}, **LOOSE)
    for length_m, told in ((1.2, True), (None, False)):
        status["axes"] = [{"name": "left", "cable_length_m": x} for x in (1.1, length_m)]
        assert ("`cdpr tighten --from lengths`" in next_steps(status)[-1]) is told


@pytest.mark.parametrize(
    ("left_s", "done", "steps"),
    [
        (0.0, 0.7, ["next: `cdpr tighten`"]),
        (0.3, 1.0, ["next: `cdpr tighten`"]),
        (0.3, 0.7, []),  # the winches still turn
    ],
)
def test_after_a_jog_the_next_step_is_to_tighten(
    left_s: float, done: float, steps: list[str]
) -> None:
    progress = {"tight": False, "left_s": left_s, "done": done}
    status = status_of(state="active", program="jog", program_progress=progress, last_stop=LOWERED)
    assert next_steps(status) == steps


def test_a_notice_that_repeats_the_reason_is_not_shown() -> None:
    status = status_of(state="fault", reason="left: broken", notices=["left: broken: repair it"])
    assert not any(str(line).startswith("note") for line in status_text(status))


def test_a_failing_part_is_reported_with_its_option() -> None:
    parts = {"live_view": {"error": "the live view ended: why"}, "stream": {"error": ""}}
    status = status_of(parts=parts)
    lines = [str(line) for line in status_text(status)]
    assert "--live failed: the live view ended: why" in lines
    assert not any("--stream" in line for line in lines)


def test_the_status_shows_which_motors_are_compensated() -> None:
    axes = [
        {"name": "left", "commissioned": "a", "index_known": True},
        {"name": "right", "commissioned": "b", "index_known": False},
        {"name": "lower", "commissioned": None, "index_known": True},
    ]
    told = compensation_text(axes)
    assert told == (
        "compensated: left; not compensated until its index passes: right; not commissioned: lower"
    )
    assert compensation_text([{"name": "left"}]) == ""


def test_learnt_motor_friction_is_shown_once_significant() -> None:
    progress = {"learnt_friction_Nm": [0.08, 0.11], "learnt_cogging_Nm": [0.0, 0.0]}
    told = learnt_text({"program_progress": progress})
    assert told == "estimated from the motors: friction 0.080 to 0.110 Nm"
    assert learnt_text({"program_progress": {"learnt_friction_Nm": [0.0, 0.0]}}) == ""
    assert learnt_text({"program_progress": {}}) == ""


@pytest.mark.parametrize(
    ("told", "power"),
    [
        ({"driving": True}, "drives that had power stop without its heartbeat"),
        ({"busy": True}, "drives that had power stop without its heartbeat"),
        ({}, "its drives had been commanded to switch off"),
        ({"read_only": True, "driving": True}, "it only listened"),
    ],
)
def test_a_dead_loop_is_shown_with_old_values_marked_as_such(
    told: dict[str, Any], power: str
) -> None:
    progress = {"position_m": [0.3, 2.0], "target_m": [0.0, 1.0], "tight": True, "stage": "pull"}
    reason = "the loop has died: killed by signal 9"
    status = status_of(state="dead", program="pose", reason=reason, program_progress=progress)
    status["loop"] = {"silent_s": 14.2}
    lines = [str(line) for line in status_text(status | told)[:-1]]
    assert lines[0].startswith("bench: dead") and "pose" not in lines[0]
    assert lines[1] == f"reason: {reason}"
    assert lines[2].startswith(power)
    assert lines[3].startswith("next: `cdpr stop`")
    assert "is 14 s old" in lines[4] and "its present position is not known" in lines[4]
    assert len(lines) == 5
    assert power in death_text(status | told) and "next: `cdpr stop`" in death_text(status)


def test_a_hanging_loop_is_reported_before_older_values() -> None:
    status = status_of(program="hold") | {"driving": True, "loop": {"silent_s": 13.6}}
    lines = [str(line) for line in status_text(status)[:-1]]
    assert lines[1] == "the loop has run no cycle for 13.6 s: the values below are that old"
    assert lines[2].startswith("drives that had power stop without its heartbeat")
    # in lockstep, the time of the simulated drives stands too
    lines = [str(line) for line in status_text(status | {"lockstep": True})[:-1]]
    assert lines[1].startswith("the loop has run no cycle")
    assert not any("stop without" in line for line in lines)


def test_a_stop_in_progress_without_reason_names_the_command() -> None:
    class Stopping:
        def get(self, _path: str) -> dict[str, Any]:
            return status_of(
                state="active", program="lower", reacting="controlled stop",
                commanded="disable by eve@lab",
            )  # fmt: skip

    with pytest.raises(WorkFailedError, match=r"^disable by eve@lab \(controlled stop under way"):
        finish(Stopping(), Output(False), Outcome())  # type: ignore[arg-type]


def test_lowering_a_platform_of_unknown_pose_is_not_described_as_moving_home() -> None:
    assert stage_text("lower", {"stage": "home", "blind": False}).startswith("moving the platform")
    assert stage_text("lower", {"stage": "home", "blind": True}) == "lowering the platform"
    for stage in ("home", "down"):  # it already stands, or its pose is unknown
        slack = {"stage": stage, "blind": True, "was_tight": False}
        assert stage_text("lower", slack).startswith("paying out the cables")


def test_a_path_is_shown_as_left_until_it_is_complete() -> None:
    path = {"name": "part.nc", "line": 7, "time_s": 5.0, "duration_s": 10.0}
    status = status_of(state="active", program="hold", program_progress={"path": path})
    assert "path part.nc stopped at 50 %, line 7" in str(status_text(status)[1])
    path["time_s"] = 10.0
    assert not any("part.nc" in str(line) for line in status_text(status))


@pytest.mark.parametrize(
    ("keys", "told"),
    [
        ({"axes": [{"name": "left", "alive": True}]}, "stopped, power off"),
        ({"axes": []}, "stopped, power off"),  # before the drive booted
        (
            {"axes": [{"name": "left", "alive": False}, {"name": "right", "alive": True}]},
            "stopped; these drives do not answer and may have power: left",
        ),
        ({"read_only": True}, "ended: it only listened and commanded no drive"),
        (
            {"state": "dead", "driving": True},
            "ended; its loop had died: drives that",
        ),
    ],
)
def test_power_off_after_a_stop_is_reported_only_if_known(keys: dict[str, Any], told: str) -> None:
    assert after_stop_text(status_of(**keys)).startswith(told)


def test_progress_of_an_earlier_motion_is_not_reported(capsys: pytest.CaptureFixture[str]) -> None:
    moved = {"target_m": [0.1, 0.2], "held_back": "friction"}
    before = status_of(state="active", program="hold", program_progress=moved)
    notes = ProgressNotes(Output(False), before)
    notes(before)
    assert not capsys.readouterr().err
    home = {"stage": "home", "held_back": "friction"}
    notes(status_of(program="lower", program_progress=home))
    assert len(capsys.readouterr().err.splitlines()) == 1
    ProgressNotes(Output(False))(before)
    assert "moving to 100.0, 200.0 mm" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("factor", "first", "slow"),
    [
        (None, "bench: active, lockstep", []),
        (0.97, "bench: active, lockstep at 0.97 of real time", []),
        (
            0.4,
            "bench: active, lockstep",
            ["the simulation runs at 0.40 of real time"],
        ),
    ],
)
def test_a_slow_simulation_is_reported(
    factor: float | None,
    first: str,
    slow: list[str],
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    status = status_of(state="active", lockstep=True, real_time_factor=factor)
    lines = [str(line) for line in status_text(status)]
    assert lines[0] == first
    assert [line.partition(": ")[0] for line in lines if "simulation" in line] == slow
    notes, now_s = ProgressNotes(Output(False)), time.monotonic()
    monkeypatch.setattr(time, "monotonic", lambda: now_s + 3.0)
    notes(status)
    notes(status)
    assert capsys.readouterr().err.splitlines() == slow
