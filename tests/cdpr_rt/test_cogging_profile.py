"""A stored profile comes back as it was, and is refused where it does not belong."""

import json
import re
from datetime import UTC, datetime

import numpy as np
import pytest

from cdpr_rt.cogging_profile import (
    CoggingProfile,
    CoggingProfileError,
    DriveIdentity,
    StoredFriction,
    StoredHarmonic,
    StoredMethod,
)

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
    table = (list(np.sin(np.arange(16.0))), list(np.cos(np.arange(16.0))))
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
        better=method,
    )


def test_round_trip(tmp_path):
    path = tmp_path / "p.json"
    profile().save(path)
    assert CoggingProfile.load(path) == profile()
    assert [p.name for p in tmp_path.iterdir()] == ["p.json"]


def test_compensation_is_what_was_stored():
    axis = profile().compensation("better", IDENTITY, "MPP0923D")
    assert axis.table_Nm.shape == (2, 16)
    assert axis.look_ahead_s == 0.002
    assert axis.friction.coulomb_backward_Nm == 0.07


@pytest.mark.parametrize("key", list(IDENTITY.model_dump()))
def test_another_drive_is_refused_by_name(key):
    other = IDENTITY.model_copy(update={key: 99})
    with pytest.raises(CoggingProfileError, match=f"{key} = {getattr(IDENTITY, key)}.*99"):
        profile().compensation("better", other, "MPP0923D")


def test_another_motor_or_no_index_is_refused():
    with pytest.raises(CoggingProfileError, match=r"MPP0923D.*MPP1003"):
        profile().compensation("better", IDENTITY, "MPP1003")
    with pytest.raises(CoggingProfileError, match="index"):
        profile().compensation("better", IDENTITY, "MPP0923D", index_will_be_seen=False)


def spoil(change):
    data = json.loads(profile().model_dump_json())
    change(data)
    return json.dumps(data)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (lambda: profile().model_dump_json()[:200], "not a cogging profile"),
        (lambda: spoil(lambda d: d.pop("motor")), "motor"),
        (lambda: spoil(lambda d: d["identity"].update(serial="x")), "identity.serial = x"),
        (lambda: spoil(lambda d: d.update(colour="red")), "colour = red"),
        (lambda: spoil(lambda d: d.update(inertia_kg_m2=-1.0)), "inertia_kg_m2 = -1"),
        (lambda: spoil(lambda d: d["better"]["table_Nm"][0].pop()), "better.table_Nm"),
    ],
)
def test_a_damaged_file_is_refused_with_the_reason(tmp_path, text, message):
    path = tmp_path / "p.json"
    path.write_text(text())
    with pytest.raises(CoggingProfileError, match=re.escape(message)) as error:
        CoggingProfile.load(path)
    assert str(path) in str(error.value)


def test_a_missing_file_is_refused(tmp_path):
    with pytest.raises(CoggingProfileError, match="cannot be read"):
        CoggingProfile.load(tmp_path / "none.json")
