"""Plant files of robots and motors: defaults, variation and rejected values."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

import pytest

from cdpr_profiles import load_winch
from cdpr_profiles.errors import ProfileError
from cdpr_sim_bus.robot.plant import Plant
from cdpr_sim_bus.robot.robot_plant import RobotPlant
from tests.sim_bus.robot.body_lab import body, free_length_m, run


def test_motors_of_a_robot_differ_reproducibly() -> None:
    motors = RobotPlant().motor_plants(3)
    assert motors == RobotPlant().motor_plants(3)
    assert len({motor.cogging[0].phase_deg for motor in motors}) == 3
    assert len({motor.encoder.index_deg for motor in motors}) == 3
    given = RobotPlant.model_validate({"motors": ({}, {"seed": 1}, {"seed": 2})})
    assert [motor.seed for motor in given.motor_plants(3)] == [7, 1, 2]


@pytest.mark.parametrize(
    ("table", "reason"),
    [
        ({"motors": ({},)}, "motors: 1 entries; allowed: 3, one for each axis"),
        ({"start": {"slack_m": (0.01, 0.02)}}, "start.slack_m: 2 entries; allowed: 3"),
        ({"cables": {"drum_radius_errors": (0.01,)}}, "cables.drum_radius_errors: 1 entries"),
        (
            {"geometry": {"exit_errors_m": ((0.0, 0.0), (0.0, 0.0), (0.0, 0.0, 0.1))}},
            r"geometry.exit_errors_m\[2\]: value \[0.0, 0.0, 0.1\]; allowed: 2",
        ),
        (
            {"cables": {"slips": ({"cable": 4, "at_s": 1.0, "slip_m": 0.01},)}},
            r"cables.slips\[0\].cable: 4; allowed: 1 to 3",
        ),
        ({"start": {"position_m": (0.0, 1.0, 2.0)}}, r"start.position_m: value \[0.0, 1.0, 2.0\]"),
        ({"motor": {"load": {"kind": "hung_mass"}}}, "motor.load: allowed: only inertia_kg_m2,"),
    ],
)
def test_a_plant_that_does_not_fit_the_robot_is_rejected(
    table: dict[str, object], reason: str
) -> None:
    with pytest.raises(ValueError, match=reason):
        RobotPlant.model_validate(table).require_fit(3, 2)


def test_slack_is_one_number_for_all_cables_or_one_for_each(tmp_path: Path) -> None:
    path = tmp_path / "plant.toml"
    for text, read in (("0.1", (0.1,)), ("[0.1, 0.0, 0.2]", (0.1, 0.0, 0.2))):
        path.write_text(f"start.slack_m = {text}\n")
        plant = RobotPlant.load_file(path)
        plant.require_fit(3, 2)
        assert plant.start.slack_m == read
    for text, where in (("-0.1", "slack_m[0]: value -0.1"), ("[0.1, 'a', 0]", "slack_m[1]: value")):
        path.write_text(f"start.slack_m = {text}\n")
        with pytest.raises(ProfileError, match=re.escape(f"plant.toml: start.{where}")) as caught:
            RobotPlant.load_file(path)
        assert len(str(caught.value).splitlines()) == 1


def test_a_cable_slips_once_at_the_specified_time() -> None:
    slips = (
        {"cable": 2, "at_s": 0.02, "slip_m": 0.012},
        {"cable": 1, "at_s": 0.01, "slip_m": -0.003},
    )
    robot, other = (
        body(locked=True, cables={"slips": one}, floor={"present": True}) for one in (slips, ())
    )
    seen = []
    for first_s in (0.0, 0.015, 0.03):
        run(robot, 0.015, begin_s=first_s)
        run(other, 0.015, begin_s=first_s)
        seen.append((free_length_m(robot) - free_length_m(other))[:2])
    assert seen[0] == pytest.approx([-0.003, 0.0], abs=1e-4)
    assert seen[1] == pytest.approx([-0.003, 0.012], abs=1e-4)
    assert seen[2] == pytest.approx([-0.003, 0.012], abs=1e-4)


def test_the_plant_of_a_single_motor_is_rejected(tmp_path: Path) -> None:
    path = tmp_path / "plant.toml"
    path.write_text("[friction]\ncoulomb_Nm = 0.1\n")
    with pytest.raises(ProfileError, match="friction"):
        RobotPlant.load_file(path)
    path.write_text("[motor.load]\ninertia_kg_m2 = 1e-4\n[motor.friction]\ncoulomb_Nm = 0.1\n")
    RobotPlant.load_file(path).require_fit(3, 2)


WORSE = """\
seed = 12
[platform]
mass_error = 0.05
[geometry]
exit_sigma_m = 0.004
anchor_errors_m = [[0.001, 0.0], [0.0, -0.001], [0.001, 0.001]]
[cables]
stiffness_error = -0.2
drum_radius_errors = [0.002, -0.002, 0.001]
[[motor.cogging]]
order = 4
amplitude_Nm = 0.08
[[motor.cogging]]
order = 24
amplitude_Nm = 0.02
[motor.friction]
coulomb_Nm = 0.13
"""


def test_the_documentation_shows_the_defaults_of_a_plant(tmp_path: Path) -> None:
    page = Path(__file__).parents[3] / "docs" / "how-to" / "simulated-robot.md"
    (shown,) = re.findall(r"```toml\n(.*?)```", page.read_text(), re.DOTALL)
    path = tmp_path / "plant.toml"
    path.write_text(shown)
    default = RobotPlant()
    assert RobotPlant.load_file(path) == default
    for section in (
        "platform",
        "geometry",
        "cables",
        "winding",
        "start",
        "floor",
        "variation",
        "scanner",
    ):
        for key in type(getattr(default, section)).model_fields:
            assert f"\n{key} = " in shown or f"\n# {key} = " in shown, f"{section}.{key}"


def test_a_plant_may_differ_in_all_parts(tmp_path: Path) -> None:
    path = tmp_path / "plant.toml"
    path.write_text(WORSE)
    worse = RobotPlant.load_file(path)
    worse.require_fit(3, 2)
    assert worse.geometry.anchor_errors_m[2] == (0.001, 0.001)
    assert [term.order for term in worse.motor_plants(3)[0].cogging] == [4, 24]


def test_values_that_a_plant_omits_follow_the_winch() -> None:
    winch = load_winch("winch-mpp0923d")
    assert RobotPlant().motor_plants(3, [winch] * 3) == RobotPlant().motor_plants(3)
    assert Plant().of(winch) == Plant()
    motor = winch.motor.model_copy(
        update={"rated_torque_Nm": 0.6, "rotor_inertia_kg_m2": 2e-5, "peak_current_Arms": 11.4}
    )
    small = replace(winch, motor=motor, encoder_counts_per_turn=10_000)
    said = Plant.model_validate({"friction": {"coulomb_Nm": 0.05}})
    of_it = said.of(small)
    assert of_it.inertia_kg_m2 == 2e-5 and of_it.encoder.counts_per_turn == 10_000
    assert of_it.cogging[0].amplitude_Nm == pytest.approx(0.2 * 0.06)
    assert of_it.friction.coulomb_Nm == 0.05 and of_it.friction.breakaway_Nm == 0.0625
    assert of_it.friction.sigma0_Nm_rad == pytest.approx(4.0)
    assert of_it.drive.overcurrent_Arms == pytest.approx(15.0)
    assert of_it.of(small) == of_it
    one, other, _ = RobotPlant().motor_plants(3, [small, winch, winch])
    assert one.friction.coulomb_Nm < 0.3 * other.friction.coulomb_Nm
    assert one.of(small) == one


# The plant file of a single motor.

EXAMPLE = """
seed = 7
[motor]
torque_constant_error = 0.04
inertia_kg_m2 = 1.130e-4
[[cogging]]
order = 4
amplitude_Nm = 0.06
phase_deg = 17.0
kind = "torque"
[friction]
coulomb_Nm = 0.08
breakaway_Nm = 0.10
stribeck_rad_s = 0.2
viscous_Nms_rad = 5e-4
sigma0_Nm_rad = 20.0
sigma1_Nms_rad = 0.02
direction_asymmetry = 0.1
[encoder]
counts_per_turn = 8192
index_deg = 123.4
noise_counts = 0.3
[drive]
current_loop_bandwidth_Hz = 500
feedback_delay_s = 0.0005
[thermal]
cogging_per_K = -0.001
friction_per_K = -0.004
time_constant_s = 600
"""


def load(tmp_path: Path, text: str) -> Plant:
    path = tmp_path / "plant.toml"
    path.write_text(text)
    return Plant.load_file(path)


def test_example_is_the_default(tmp_path: Path) -> None:
    assert load(tmp_path, EXAMPLE) == load(tmp_path, "") == Plant()


def test_each_changed_line_of_the_example_changes_the_plant(tmp_path: Path) -> None:
    changes = {"4\n": "5\n", "0.06": "0.05", "17.0": "18.0", '"torque"': '"current_offset"'}
    for old, new in changes.items():
        assert load(tmp_path, EXAMPLE.replace(old, new, 1)) != Plant()


def test_breakaway_torque_defaults_to_a_multiple_of_coulomb_friction(tmp_path: Path) -> None:
    plant = load(tmp_path, "[friction]\ncoulomb_Nm = 0.2\n")
    assert plant.friction.breakaway_Nm == pytest.approx(0.25)


@pytest.mark.parametrize(
    ("text", "key", "told"),
    [
        ("[friction]\ncolomb_Nm = 0.1", "friction.colomb_Nm", "coulomb_Nm"),
        ("[friction]\ncoulomb_Nm = -0.1", "friction.coulomb_Nm", "-0.1"),
        ("[friction]\ncoulomb_Nm = 0.1\nbreakaway_Nm = 0.05", "friction", "0.05"),
        ("[friction]\ncoulomb_Nm = '0.1'", "friction.coulomb_Nm", "0.1"),
        ("[friction]\ncoulomb_Nm = nan", "friction.coulomb_Nm", "nan"),
        ("[[cogging]]\norder = 0", "cogging[0].order", "0"),
        ("[[cogging]]\nkind = 'magnetic'", "cogging[0].kind", "current_offset"),
        ("[cogging]\norder = 4", "cogging", "cogging"),
        ("[encoder]\ncounts_per_turn = 8192.5", "encoder.counts_per_turn", "8192.5"),
        ("[motor]\ninertia_kg_m2 = 0", "motor.inertia_kg_m2", "0"),
        ("[drive]\nfeedback_delay_s = 1.0", "drive.feedback_delay_s", "0.01"),
        ("[thermal]\ntime_constant_s = 0", "thermal.time_constant_s", "0"),
        ("[limits]\nnegative_deg = 10.0\npositive_deg = 5.0", "limits", "negative_deg"),
        ("[gears]\nratio = 4", "gears", "gears"),
        ("seed = true", "seed", "seed"),
    ],
)
def test_error_for_a_wrong_key_or_value_names_it(
    tmp_path: Path, text: str, key: str, told: str
) -> None:
    with pytest.raises(ProfileError) as caught:
        load(tmp_path, text)
    assert caught.value.key == key
    assert told in str(caught.value)
    assert "plant.toml" in str(caught.value)
