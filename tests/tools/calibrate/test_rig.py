"""The calibration procedure on a simulated robot over its bus, with a scanner."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from cdpr_profiles import load_robot
from cdpr_rt.errors import TripError
from cdpr_tools.calibrate import measure_poses as measuring
from cdpr_tools.calibrate.measure_poses import (
    NotThePoseError,
    StoppedError,
    StoredPoses,
    measure_poses,
    read_pose,
)
from cdpr_tools.calibrate.places import chosen_places
from cdpr_tools.calibrate.rig import OutsidePose, simulated_rig
from cdpr_tools.calibrate.run import no_poses

pytestmark = [pytest.mark.long, pytest.mark.usefixtures("slower_profiles")]

_PLANT = """
[geometry]
exit_errors_m = [[0.006, 0.0], [0.0, -0.006], [0.0, 0.005]]
[scanner]
position_sigma_m = 0.0005
"""


def stored(folder: Path) -> StoredPoses:
    return StoredPoses(folder, no_poses(load_robot("planar-3"), True))


class Notes:
    def note(self, text: str) -> None:
        raise AssertionError(text)


def test_home_and_poses_are_read_and_measured(tmp_path: Path) -> None:
    plant = tmp_path / "plant.toml"
    plant.write_text(_PLANT)
    places = chosen_places(load_robot("planar-3"), 6, 3)
    outside: list[OutsidePose] = []
    with simulated_rig("planar-3", plant=plant, scanner=True) as operator:
        measured = stored(tmp_path)
        measured.added = lambda _: outside.append(operator.outside())
        measured.add(read_pose(operator, operator.tighten()), operator)
        measure_poses(operator, places.chosen[:2], places.middle, measured, Notes())
    assert len(measured.data.poses) == len(outside) == 3
    for reading, other in zip(measured.data.poses, outside, strict=True):
        assert reading.position_m is not None
        off = np.array(reading.position_m[:2]) - np.array(reading.target[:2])
        # the true exit points differ from the file by some millimetres
        assert 1e-5 < float(np.linalg.norm(off)) < 0.03
        assert reading.position_std_m is not None and 1e-4 < reading.position_std_m < 3e-4
        assert min(reading.tension_N) > 5.0 and min(reading.length_m) > 0.5
        assert other.position_m == reading.position_m
        missed = np.array(other.true_position_m) - np.array(reading.position_m)
        assert float(np.linalg.norm(missed)) < 6.0 * reading.position_std_m


def test_a_stop_request_is_obeyed_between_two_cycles() -> None:
    wanted: list[bool] = []
    with (
        pytest.raises(StoppedError),
        simulated_rig("planar-3", plant=None, scanner=False, stop=lambda: bool(wanted)) as operator,
    ):
        operator.tighten()
        wanted.append(True)
        operator.move_to(chosen_places(load_robot("planar-3"), 1, 3).middle)


def test_a_pose_not_reached_in_time_is_read_where_the_platform_is_held(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    places, said = chosen_places(load_robot("planar-3"), 3, 3), list[str]()
    first, second = places.chosen[:2]

    class Noted:
        def note(self, text: str) -> None:
            said.append(text)

    with simulated_rig("planar-3", plant=None, scanner=False) as operator:
        operator.tighten()
        monkeypatch.setattr(measuring, "_SLOWED", 0.3)
        monkeypatch.setattr(measuring, "_LATE_S", 0.0)
        measured = stored(tmp_path)
        measure_poses(operator, [first], places.middle, measured, Noted())
        true = operator.rig.truth()["position_m"][:2].copy()
        monkeypatch.undo()
        measure_poses(operator, [second], places.middle, measured, Noted())
    stood, other = measured.data.poses
    assert np.linalg.norm(np.array(stood.target) - first) > 0.1
    assert np.array(stood.target) == pytest.approx(true, abs=0.01)
    assert measured.data.tried == (tuple(first.tolist()),) and measured.failures == 0
    assert other.target == tuple(second.tolist())
    assert len(said) == 1 and said[0].startswith("pose 1, at ")
    assert "is read where the platform stands" in said[0] and "mm off after" in said[0]


@pytest.mark.parametrize("when", ["on its way", "before it is read", "while it is read"])
def test_an_emergency_stop_does_not_mark_the_pose_as_tried(
    when: str, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    places = chosen_places(load_robot("planar-3"), 3, 3)
    with simulated_rig("planar-3", plant=None, scanner=False) as operator:
        operator.tighten()
        rig = operator.rig
        measured, pressed_s = stored(tmp_path), list[float]()
        name = {"on its way": "move_to", "before it is read": "wait", "while it is read": "read"}[
            when
        ]
        told = getattr(operator, name)

        def pressing(what: Any) -> Any:
            begun_s, turn = rig.now_s, rig.loop.turn

            def press(**how: bool) -> None:
                turn(**how)
                if rig.now_s > begun_s + 0.3 and not pressed_s:
                    pressed_s.append(rig.now_s)
                    rig.loop.request_power_off()

            monkeypatch.setattr(rig.loop, "turn", press)
            return told(what)

        monkeypatch.setattr(operator, name, pressing)
        with pytest.raises(NotThePoseError, match="emergency stop"):
            measure_poses(operator, places.chosen[:2], places.middle, measured, Notes())
        assert pressed_s and not measured.data.tried and not measured.data.poses
        monkeypatch.undo()
        with pytest.raises(NotThePoseError):  # during the fault, no pose is marked either
            operator.move_to(places.middle)


def test_a_drive_fault_during_the_motion_marks_the_pose_as_tried(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    places = chosen_places(load_robot("planar-3"), 3, 3)
    with simulated_rig("planar-3", plant=None, scanner=False) as operator:
        operator.tighten()
        measured, begin = stored(tmp_path), operator.robot.move_to

        def failing(*arguments: Any, **options: Any) -> None:
            begin(*arguments, **options)
            operator.rig.inject(1, 1, 0x2310)

        monkeypatch.setattr(operator.robot, "move_to", failing)
        with pytest.raises(TripError) as caught:
            measure_poses(operator, places.chosen[:1], places.middle, measured, Notes())
    assert not isinstance(caught.value, NotThePoseError)
    assert measured.data.tried == (tuple(places.chosen[0].tolist()),)


def test_a_drive_fault_before_the_motion_does_not_mark_the_pose_as_tried(tmp_path: Path) -> None:
    places = chosen_places(load_robot("planar-3"), 3, 3)
    with simulated_rig("planar-3", plant=None, scanner=False) as operator:
        operator.tighten()
        measured = stored(tmp_path)
        operator.rig.inject(1, 1, 0x2310)
        with pytest.raises(NotThePoseError):
            measure_poses(operator, places.chosen[:1], places.middle, measured, Notes())
    assert measured.data.tried == ()
