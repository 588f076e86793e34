"""Figures of each trial in space for synthetic motion with known figures."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from cdpr_profiles import load_robot
from cdpr_sim_bus.robot.robot_plant import RobotPlant
from cdpr_tools.trials import limits, line, pictures, streaming, tape, targets
from cdpr_tools.trials.directions import Directions
from cdpr_tools.trials.figures import Figure
from tests.tools.trials.made_up_trial import PERIOD_S, PLANE, POINT, SPACE, recorded

ROBOT = load_robot("planar-3")
HERE = np.array([0.1, -0.2, 1.5, 0.1, 0.05, -0.15])
DIRECTIONS = pytest.mark.parametrize("directions", [PLANE, POINT, SPACE], ids=["2", "3", "6"])


def figures_of(found: list[Figure]) -> dict[str, Figure]:
    return {figure.key: figure for figure in found}


def turn_about(axis: np.ndarray, angle: float) -> np.ndarray:
    """Return the rotation matrix by Rodrigues' formula."""
    x, y, z = axis / np.linalg.norm(axis)
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    return np.eye(3) + np.sin(angle) * cross + (1.0 - np.cos(angle)) * cross @ cross


@given(st.lists(st.floats(-1.7, 1.7), min_size=6, max_size=6))
@settings(max_examples=50)
def test_a_place_is_position_and_rotation_vector_from_home(values):
    place = np.array(values)
    angle = float(np.linalg.norm(place[3:]))
    turned = turn_about(place[3:], angle) if angle > 0.0 else np.eye(3)
    rotation = turned @ SPACE.home_rotation
    np.testing.assert_allclose(SPACE.rotations(place[None])[0], rotation, atol=1e-12)
    np.testing.assert_allclose(SPACE.places(place[None, :3], rotation[None])[0], place, atol=1e-7)
    mark = SPACE.marked(place, "target")
    assert SPACE.place(mark, "target").tolist() == place.tolist()


@pytest.mark.parametrize("spin", [0.0, -0.4, 3.0])
def test_rotation_of_a_rod_about_its_axis_does_not_count_as_error(spin):
    rod = replace(SPACE, names=("x", "y", "z", "rx", "ry"))
    wanted = np.array([0.1, -0.2, 1.5, 0.1, 0.05])
    tilted = np.array([0.1, -0.2, 1.5, -0.03, 0.12])
    own_axis = rod.home_rotation.T[:, 2]
    target, true = rod.rotations(np.array([wanted, tilted]))
    spun = true @ turn_about(own_axis, spin)
    np.testing.assert_allclose(rod.places(tilted[None, :3], spun[None])[0], tilted, atol=1e-12)
    off = np.linalg.norm(rod.turn_between(target, spun))
    assert off == pytest.approx(np.arccos((target @ own_axis) @ (true @ own_axis)))
    assert np.linalg.norm(rod.turn_between(spun, spun)) == 0.0


def test_rotation_about_two_free_axes_does_not_count_as_error():
    upright = replace(SPACE, names=("x", "y", "z", "rz"), home_rotation=np.eye(3))
    turn = Rotation.from_rotvec([0.2, -0.1, 0.3]).as_matrix()
    np.testing.assert_allclose(upright.turn_between(np.eye(3), turn), [0.0, 0.0, 0.3], atol=1e-12)


def test_an_angle_in_the_plane_is_about_the_third_axis():
    plane = Directions(
        ("x", "y", "angle"), turn_about(np.array([0, 0, 1.0]), 0.4), np.zeros(2), np.ones(2),
        0.5, np.ones(3), np.ones(3),
    )  # fmt: skip
    rotation = turn_about(np.array([0.0, 0.0, 1.0]), 0.7)
    place = plane.places(np.array([[0.2, 0.3, 0.0]]), rotation[None])[0]
    assert place == pytest.approx([0.2, 0.3, 0.3])
    assert plane.arguments(place) == {
        "position_m": [0.2, 0.3],
        "rotation_rad": pytest.approx([0.3]),
    }


def test_targets_of_a_point_contain_no_rotation():
    assert POINT.arguments(POINT.middle, 0.1) == {"position_m": [0.0, 0.0, 1.5], "speed_m_s": 0.1}


def test_errors_at_targets_in_space_are_per_direction_and_of_the_orientation():
    chance = np.random.default_rng(4)
    goals = HERE + chance.uniform(-0.2, 0.2, (6, 6))
    off_m = chance.uniform(-1e-3, 1e-3, (6, 3))
    angle = chance.uniform(0.0, 2e-3, 6)
    axis = chance.standard_normal((6, 3))
    true, rotations, marks = np.repeat(goals, 200, axis=0), [], []
    for i in range(6):
        true[200 * i : 200 * (i + 1), :3] += off_m[i]
        rotations.append(turn_about(axis[i], angle[i]) @ SPACE.rotations(goals[i : i + 1])[0])
        marks.append({"mark": "measured", **SPACE.marked(goals[i], "target"), "row": 200 * i + 199})
    made = recorded(true, true, marks, SPACE)
    made.truth["rotation"] = np.repeat(rotations, 200, axis=0)
    found = figures_of(targets.judge(made))
    for i, name in enumerate("xyz"):
        assert found[f"mean_{name}_mm"].value == pytest.approx(1e3 * abs(off_m[:, i].mean()))
        sigma = 3e3 * off_m[:, i].std(ddof=1)
        assert found[f"three_sigma_{name}_mm"].value == pytest.approx(sigma)
        assert found[f"mean_{name}_mm"].limit == 0.5
        assert found[f"three_sigma_{name}_mm"].limit == 1.5
    error = found["orientation_error_deg"]
    turns = np.degrees(angle)[:, None] * axis / np.linalg.norm(axis, axis=1, keepdims=True)
    assert error.value == pytest.approx(np.linalg.norm(turns.mean(axis=0)), rel=1e-4)
    assert (error.limit, error.reached) == (0.05, bool(error.value <= 0.05))
    sigma = found["orientation_three_sigma_deg"]
    assert sigma.value == pytest.approx(3.0 * turns.std(axis=0, ddof=1).max(), rel=1e-4)
    assert sigma.limit == 0.15
    pictures.of_targets(made)


def test_a_point_has_no_orientation_error():
    goals = np.tile(HERE[:3], (600, 1))
    marks = [{"mark": "measured", **POINT.marked(HERE[:3], "target"), "row": k} for k in (200, 500)]
    made = recorded(goals, goals, marks, POINT)
    made.truth["rotation"][:] = turn_about(np.array([1.0, 1.0, 0.0]), 0.5)
    keys = figures_of(targets.judge(made)).keys()
    assert "mean_z_mm" in keys
    assert not [key for key in keys if "orientation" in key]


@DIRECTIONS
def test_each_direction_has_a_line_within_the_workspace(directions):
    found = line.lines(directions)
    assert len(found) == directions.d
    for i, (start, end) in enumerate(found):
        way = end - start
        assert np.flatnonzero(way).tolist() == [i]
        assert 0.5 * (start + end) == pytest.approx(directions.middle)
        assert 0.0 < way[i] <= (0.6 if i < directions.k else directions.angle_rad)


def ridden(axis: int, ripple: np.ndarray) -> object:
    """Return a line along one direction, with a ripple (6,) in all directions."""
    start, end = line.lines(SPACE)[axis]
    way = np.linspace(0.0, 1.0, 4000)[:, None]
    setpoint = start + way * (end - start)
    true = setpoint + np.sin(400.0 * way) * ripple
    ends = {**SPACE.marked(start, "from"), **SPACE.marked(end, "to")}
    marks = [{"mark": "line", **ends}, {"mark": "line end", "row": 4000}]
    return recorded(true, setpoint, marks, SPACE)


@pytest.mark.parametrize("axis", [0, 1, 2])
def test_the_error_of_a_line_in_space_is_the_distance_from_it(axis):
    ripple = np.array([1.0, 2.0, 3.0, 0.0, 0.0, 0.0]) * 1e-3
    across = np.delete(ripple, axis)
    found = figures_of(line.judge({line.WITHOUT: ridden(axis, ripple)}, line.SPEED_m_s))
    rms = 1e3 * np.linalg.norm(across) / np.sqrt(2.0)
    assert found["path_without_mm"].value == pytest.approx(rms, rel=0.01)
    rms = 1e3 * np.linalg.norm(ripple) / np.sqrt(2.0)
    assert found["setpoint_without_mm"].value == pytest.approx(rms, rel=0.01)
    assert found["setpoint_without_mm"].limit is None
    assert found["orientation_without_deg"].value == pytest.approx(0.0, abs=1e-6)
    assert "turn_without_mm" not in found


def test_the_error_of_a_turn_is_an_angle_and_the_motion_of_the_origin():
    parts = {line.WITHOUT: ridden(1, np.zeros(6))}
    turned = ridden(4, np.array([0.0, 2e-3, 0.0, 0.0, 1e-3, 0.0]))
    (errors,) = line.line_errors(turned)
    assert errors.is_turn
    assert np.ptp(errors.way) == pytest.approx(0.3, rel=0.01)
    off_deg = np.linalg.norm(errors.off_deg, axis=1)
    assert np.sqrt(np.mean(off_deg**2)) == pytest.approx(np.degrees(1e-3 / np.sqrt(2.0)), rel=0.01)
    made = recorded(
        np.vstack([parts[line.WITHOUT].true_places, turned.true_places]),
        np.vstack([parts[line.WITHOUT].setpoint_places, turned.setpoint_places]),
        [*_again(parts[line.WITHOUT], 0), *_again(turned, 4000)],
        SPACE,
    )
    found = figures_of(line.judge({line.WITHOUT: made}, 0.5))
    assert found["turn_without_mm"].value == pytest.approx(2.0 / np.sqrt(2.0), rel=0.01)
    assert found["orientation_without_deg"].value == pytest.approx(np.degrees(5e-4), rel=0.01)
    assert found["path_without_mm"].value == pytest.approx(0.0, abs=1e-6)
    assert found["setpoint_without_mm"].limit == 2.0
    pictures.of_lines({line.WITHOUT: made}, 0.5)


def _again(made, rows):
    return [{**mark, "row": rows + mark.get("row", 0)} for mark in made.marks]


def swung(dies_s: float, over: np.ndarray) -> object:
    """Return a leg of 0.5 s, after which the platform oscillates by `over` (6,) at 1 Hz."""
    time_s = np.arange(4500) * PERIOD_S
    goal = HERE + np.array([0.3, 0.2, 0.1, 0.02, -0.03, 0.04])
    share = np.clip(time_s / 0.5, 0.0, 1.0)[:, None]
    setpoint = HERE + share * (goal - HERE)
    rest = np.maximum(time_s - 0.5, 0.0)
    swing = np.sin(2.0 * np.pi * rest) * np.exp(-rest / dies_s)
    true = setpoint + swing[:, None] * over
    return recorded(true, setpoint, [{"mark": "leg", **SPACE.marked(goal, "target")}], SPACE)


def test_a_swing_lasts_until_the_platform_stays_near_its_target():
    made = swung(0.6, np.array([0.0, 0.02, 0.0, 0.0, 0.0, 0.0]))
    rest = np.arange(4000) * PERIOD_S
    off_mm = 20.0 * np.abs(np.sin(2.0 * np.pi * rest)) * np.exp(-rest / 0.6)
    expected = rest[np.flatnonzero(off_mm > 2.0)[-1]]
    found = figures_of(limits.judge(made, ROBOT))
    assert 1.0 < expected < 2.0
    assert found["swing_s"].value == pytest.approx(expected, abs=3e-3)
    assert found["swing_s"].reached
    late = figures_of(limits.judge(swung(3.0, np.array([0.02, 0, 0, 0, 0, 0])), ROBOT))
    assert late["swing_s"].value > 3.0
    assert not late["swing_s"].reached
    still = figures_of(limits.judge(swung(1.0, np.zeros(6)), ROBOT))
    assert still["swing_s"].value == 0.0


def test_no_swing_is_reported_if_the_rest_is_too_short():
    made = swung(3.0, np.array([0.02, 0, 0, 0, 0, 0]))
    made.truth, made.cycles = made.truth[:2000], {k: v[:2000] for k, v in made.cycles.items()}
    assert "swing_s" not in figures_of(limits.judge(made, ROBOT))


def test_overshoot_in_space_counts_in_each_direction_and_angle():
    made = swung(0.5, np.array([0.0, 0.0, 3e-3, 0.0, -4e-3, 0.0]))
    most = np.max(made.true_places - made.setpoint_places, axis=0)
    least = np.min(made.true_places - made.setpoint_places, axis=0)
    found = figures_of(limits.judge(made, ROBOT))
    assert found["overshoot_mm"].value == pytest.approx(1e3 * most[2], rel=1e-6)
    assert found["overshoot_deg"].value == pytest.approx(-np.degrees(least[4]), rel=1e-6)
    pictures.of_limits(made, ROBOT)


@pytest.mark.parametrize("most_rad", [0.05, 0.26, 1.5])
def test_the_bound_of_angle_rounding_holds_and_is_tight(most_rad):
    chance = np.random.default_rng(3)
    turns = chance.standard_normal((200_000, 3))
    turns *= most_rad / np.linalg.norm(turns, axis=1, keepdims=True)
    unit = 2.0 * streaming.ROUNDING
    rounded = unit * np.round(Rotation.from_rotvec(turns).as_quat() / unit)
    off = np.abs(Rotation.from_quat(rounded).as_rotvec() - turns).max()
    most = streaming.ROUNDING * streaming.angle_rounding(most_rad)
    assert 0.6 * most < off <= most


@pytest.mark.parametrize(("direction", "key"), [(2, "step_mm_s"), (5, "step_deg_s")])
@pytest.mark.parametrize(("times", "reached"), [(0.99, True), (1.05, False)])
def test_a_step_of_the_commanded_velocity_is_found_in_any_direction(direction, key, times, reached):
    velocity = np.zeros((400, 6))
    velocity[200:, direction] = times * SPACE.acceleration[direction] * PERIOD_S
    setpoint = HERE * (np.arange(6) < 3) + np.cumsum(velocity * PERIOD_S, axis=0)
    counts = {"sent": 50, "lost": 10, "doubled": 5, "overtaken": 7}
    made = recorded(setpoint, setpoint, [{"mark": "network", **counts}], SPACE)
    found = figures_of(streaming.judge(made))
    assert found[key].reached is reached
    others = {"step_mm_s", "step_deg_s"} - {key}
    assert all(found[other].value == pytest.approx(0.0, abs=1e-3) for other in others)
    pictures.of_stream(made)


def test_the_pose_of_a_hand_equals_its_place():
    place = np.array([0.01, 0.02, 0.03, 0.2, -0.1, 0.3])
    position_m, (w, x, y, z) = streaming.hand_pose(SPACE, place)
    assert position_m == place[:3].tolist()
    assert Rotation.from_quat([x, y, z, w]).as_rotvec() == pytest.approx(place[3:])
    assert streaming.hand_pose(PLANE, place[:2]) == ([0.01, 0.02, 0.0], [1.0, 0.0, 0.0, 0.0])


@pytest.mark.parametrize("seed", [1, 2])
def test_a_tape_measure_has_errors_of_some_centimetres(tmp_path, seed):
    path = tmp_path / "plant.toml"
    path.write_text("seed = 3\n[platform]\nmass_error = 0.1\n", encoding="utf-8")
    text = tape.plant_text(ROBOT, path, seed)
    (tmp_path / "more.toml").write_text(text, encoding="utf-8")
    plant = RobotPlant.load_file(tmp_path / "more.toml")
    assert (plant.seed, plant.platform.mass_error) == (3, 0.1)
    off_m = np.linalg.norm(plant.geometry.exit_errors_m, axis=1)
    assert off_m.shape == (3,)
    assert (off_m > 0.0199).all()
    assert (off_m < 0.0501).all()
    assert (text == tape.plant_text(ROBOT, path, 1)) is (seed == 1)


def test_a_plant_with_geometry_errors_is_used_unchanged(tmp_path):
    path = tmp_path / "plant.toml"
    path.write_text("[geometry]\nexit_sigma_m = 0.02\n", encoding="utf-8")
    assert tape.plant_text(ROBOT, path, 1) == path.read_text(encoding="utf-8")


def test_tensions_out_of_bounds_in_the_tape_trial_are_found():
    true = np.tile(HERE, (1000, 1))
    pose = HERE + np.array([0.003, 0.004, 0.0, 0.0, 0.0, 0.01])
    marks = [{"mark": "pose", **SPACE.marked(pose, "target"), "row": 500}]
    tension = np.full((1000, 3), 60.0)
    tension[200, 1] = 2.0
    made = recorded(true, true, marks, SPACE, tension_N=tension)
    found = figures_of(tape.judge(made, ROBOT))
    assert [found[key].value for key in ("outside_cycles", "slack_cycles", "poses")] == [1, 1, 1]
    assert found["off_mm"].value == pytest.approx(5.0)
    assert found["orientation_off_deg"].value == pytest.approx(np.degrees(0.01), rel=0.02)
    pictures.of_tape(made, ROBOT)


class HurriedRun:
    """A trial whose robot takes 10 s per pose, and its marks."""

    def __init__(self) -> None:
        self.directions, self.elapsed_s = SPACE, 0.0
        self.marks: list[dict[str, object]] = []

    def start_random_move(self, _speed_m_s: float) -> np.ndarray:
        return HERE

    def arrive(self) -> None:
        self.elapsed_s += 4.0

    def go(self, _place: np.ndarray, _speed_m_s: float) -> None:
        self.elapsed_s += 4.0

    def stay(self, seconds: float) -> None:
        self.elapsed_s += seconds

    def mark(self, what: str, **values: object) -> None:
        self.marks.append({"mark": what, "row": 50 * len(self.marks), **values})


@pytest.mark.parametrize(
    ("seconds", "poses", "wanted"), [(30.0, 3, 1), (999.0, 100, 100), (2000.0, 100, 100)]
)
def test_poses_beyond_the_duration_do_not_count_as_missed(seconds, poses, wanted):
    run = HurriedRun()
    tape.drive(run, seconds)
    true = np.tile(HERE, (6000, 1))
    found = figures_of(tape.judge(recorded(true, true, run.marks, SPACE), ROBOT))
    assert (found["poses"].value, found["poses"].limit) == (poses, wanted)
    assert found["poses"].reached
    # with enough time, missing poses count
    marks = run.marks[:2] if wanted == 100 else run.marks[-1:]
    found = figures_of(tape.judge(recorded(true, true, marks, SPACE), ROBOT))
    assert not found["poses"].reached
