"""Plant files: defaults, refusals."""

from __future__ import annotations

from pathlib import Path

import pytest

from cdpr_profiles.errors import ProfileError
from cdpr_sim_bus.robot.plant import Plant

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


def test_every_line_of_the_example_counts(tmp_path: Path) -> None:
    changes = {"4\n": "5\n", "0.06": "0.05", "17.0": "18.0", '"torque"': '"current_offset"'}
    for old, new in changes.items():
        assert load(tmp_path, EXAMPLE.replace(old, new, 1)) != Plant()


def test_breakaway_follows_a_lone_coulomb(tmp_path: Path) -> None:
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
def test_wrong_key_or_value_is_named(tmp_path: Path, text: str, key: str, told: str) -> None:
    with pytest.raises(ProfileError) as caught:
        load(tmp_path, text)
    assert caught.value.key == key
    assert told in str(caught.value)
    assert "plant.toml" in str(caught.value)
