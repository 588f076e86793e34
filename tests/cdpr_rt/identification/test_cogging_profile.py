"""A stored profile is read back unchanged, and is rejected for another motor or drive."""

import json
import re
from datetime import UTC, datetime

import numpy as np
import pytest

from cdpr_profiles import load_motor
from cdpr_profiles.motor_bounds import MotorBounds
from cdpr_rt.identification.cogging_profile import (
    IMPORTED_SERIAL,
    CoggingProfile,
    CoggingProfileError,
    DriveIdentity,
    StoredFriction,
    StoredHarmonic,
    StoredMethod,
)

MOTOR = load_motor("MPP0923D")
OTHER = MOTOR.model_copy(update={"model": "MPP1003D"})
BOUNDS = MotorBounds(MOTOR)
IDENTITY = DriveIdentity(
    vendor_id=1, product_code=2, revision=3, serial=4, encoder_counts_per_turn=8192
)
FRICTION = StoredFriction(
    coulomb_forward_Nm=0.08,
    coulomb_backward_Nm=0.07,
    stribeck_forward_Nm=0.02,
    stribeck_backward_Nm=0.02,
    stribeck_speed_rad_s=0.2,
    viscous_Nms_rad=5e-4,
)


def profile() -> CoggingProfile:
    angle = np.arange(16.0)
    table = (list(0.06 * np.sin(angle)), list(0.06 * np.cos(angle)))
    method = StoredMethod(table_Nm=table, friction=FRICTION, look_ahead_s=0.002, observer_s=0.003)
    return CoggingProfile(
        motor="MPP0923D",
        drive="generic-cia402",
        identity=IDENTITY,
        temperature_C=31.5,
        created=datetime(2024, 5, 1, tzinfo=UTC),
        raw_data=["sweep-0.raw"],
        inertia_kg_m2=1.1e-4,
        harmonics=[
            StoredHarmonic(
                order=4,
                amplitude_Nm=0.06,
                amplitude_half_width_Nm=1e-5,
                phase_deg=17.0,
                phase_half_width_deg=0.1,
                per_pole_pair=1.0,
                hint="",
            )
        ],
        residual_rms_Nm=1e-3,
        repaired_fraction=0.0,
        coverage=1.0,
        thesis=method,
        harmonic=method,
    )


def test_a_profile_is_read_back_unchanged(tmp_path):
    path = tmp_path / "p.json"
    profile().save(path)
    assert CoggingProfile.load(path) == profile()
    assert [p.name for p in tmp_path.iterdir()] == ["p.json"]


def test_compensation_has_the_stored_values():
    axis = profile().compensation("harmonic", IDENTITY, BOUNDS)
    assert axis.table_Nm.shape == (2, 16)
    assert axis.look_ahead_s == 0.002
    assert axis.friction.coulomb_backward_Nm == 0.07


def test_each_different_key_of_another_drive_is_named():
    for key, mine in IDENTITY.model_dump().items():
        other = IDENTITY.model_copy(update={key: 99})
        with pytest.raises(CoggingProfileError, match=f"{key} = {mine}.*99"):
            profile().compensation("harmonic", other, BOUNDS)


def test_a_profile_of_another_motor_is_rejected():
    with pytest.raises(CoggingProfileError, match=r"MPP0923D.*MPP1003D"):
        profile().compensation("harmonic", IDENTITY, MotorBounds(OTHER))


def spoil(change):
    data = json.loads(profile().model_dump_json(by_alias=True))
    change(data)
    return json.dumps(data)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (lambda: profile().model_dump_json(by_alias=True)[:200], "is not valid JSON"),
        (lambda: spoil(lambda d: d["identity"].update(serial="x")), "identity.serial: value 'x'"),
        (lambda: spoil(lambda d: d.update(colour="red")), "colour: unknown key"),
        (
            lambda: spoil(lambda d: d.update(inertia_kg_m2=-1.0)),
            "inertia_kg_m2: value -1.0; allowed: greater than 0",
        ),
        (lambda: spoil(lambda d: d["harmonic"]["table_Nm"][0].pop()), "harmonic.table_Nm"),
        (
            lambda: spoil(lambda d: d.update(harmonik=d.pop("harmonic"))),
            "harmonik: unknown key; did you mean 'harmonic'?",
        ),
        (
            lambda: spoil(lambda d: d.update(better=d.pop("harmonic"))),
            "harmonic: this required key is missing",
        ),
    ],
)
def test_a_damaged_file_is_rejected_with_the_reason(tmp_path, text, message):
    path = tmp_path / "p.json"
    path.write_text(text())
    with pytest.raises(CoggingProfileError, match=re.escape(message)) as error:
        CoggingProfile.load(path)
    assert str(path) in str(error.value)


def test_a_missing_file_is_rejected(tmp_path):
    with pytest.raises(CoggingProfileError, match="cannot be read"):
        CoggingProfile.load(tmp_path / "none.json")


def changed(path: str, value: object) -> CoggingProfile:
    """Return the profile with one value replaced; its path is as in `harmonic.friction.x`."""
    data = json.loads(profile().model_dump_json(by_alias=True))
    here, *keys, last = data, *path.split(".")
    for key in keys:
        here = here[int(key) if key.isdecimal() else key]
    here[int(last) if last.isdecimal() else last] = value
    return CoggingProfile.model_validate_json(json.dumps(data))


@pytest.mark.parametrize(
    ("key", "value", "message"),
    [
        (
            "harmonic.table_Nm.0.3",
            1e6,
            "harmonic.table_Nm[0]: value 1e+06; allowed: -0.75 to 0.75 Nm",
        ),
        ("thesis.table_Nm.1.0", -0.76, "thesis.table_Nm[1]: value 0.76; allowed: -0.75 to 0.75"),
        ("harmonic.friction.coulomb_forward_Nm", 0.7, "harmonic.table_Nm and friction together"),
        ("harmonic.friction.stribeck_backward_Nm", -2.0, "harmonic.friction: value 2.07"),
        (
            "harmonic.table_Nm",
            [[0.5] * 16, [0.5] * 16],
            "harmonic.mean of table_Nm and friction over both directions: value 0.505; "
            "allowed: -0.06 to 0.06 Nm, 2 % of the rated torque of MPP0923D",
        ),
        ("harmonic.friction.coulomb_backward_Nm", -0.07, "harmonic.mean of table_Nm and friction"),
        (
            "harmonic.friction.viscous_Nms_rad",
            0.0012,
            "harmonic.friction.viscous_Nms_rad: value 0.0012; allowed: -0.001158 to 0.001158",
        ),
        ("harmonic.friction.stribeck_speed_rad_s", 1e-9, "harmonic.friction.stribeck_speed_rad_s"),
        ("harmonics.0.amplitude_Nm", -0.8, "harmonics: sum of amplitude_Nm: value 0.8"),
        ("inertia_kg_m2", 1e-9, "inertia_kg_m2: value 1e-09; allowed: 5.65e-05 to 0.00565 kg m2"),
    ],
)
def test_values_impossible_for_the_motor_are_rejected(
    key: str, value: object, message: str
) -> None:
    spoilt = changed(key, value)
    for use in (
        lambda: spoilt.require_true_of(BOUNDS),
        lambda: spoilt.compensation("harmonic", IDENTITY, BOUNDS),
    ):
        with pytest.raises(CoggingProfileError, match=re.escape(message)):
            use()


def test_friction_in_the_tables_is_not_rejected_as_bias() -> None:
    level = [0.3] * 16, [-0.3] * 16
    changed("thesis.table_Nm", level).require_true_of(BOUNDS)


def test_a_table_above_the_torque_limit_of_the_axis_is_rejected() -> None:
    profile().require_true_of(BOUNDS)
    with pytest.raises(CoggingProfileError, match=r"allowed: -0.1 to 0.1 Nm, the axis' torque"):
        profile().require_true_of(MotorBounds(MOTOR, 0.1))
    assert profile().compensation("harmonic", IDENTITY, BOUNDS).most_Nm == 0.75


@pytest.mark.parametrize("key", ["look_ahead_s", "observer_s"])
@pytest.mark.parametrize("value", ["NaN", "1e999", "-1.0", "10.0", "1" * 6000])
def test_an_invalid_time_is_rejected(tmp_path, key, value):
    path = tmp_path / "p.json"
    path.write_text(
        re.sub(
            rf'"{key}": ?[0-9.e-]+', f'"{key}": {value}', profile().model_dump_json(by_alias=True)
        )
    )
    with pytest.raises(CoggingProfileError, match=r"p\.json"):
        CoggingProfile.load(path)


def test_a_profile_of_an_imported_recording_says_how_to_name_its_drive() -> None:
    imported = profile().model_copy(
        update={"identity": IDENTITY.model_copy(update={"serial": IMPORTED_SERIAL})}
    )
    with pytest.raises(CoggingProfileError, match=r"imported recording.*write 4 into the profile"):
        imported.compensation("harmonic", IDENTITY, BOUNDS)
