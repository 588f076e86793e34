"""An inclinometer on a real serial line (a pseudo-terminal), on a simulated platform."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from cdpr_drivers.modbus.channel import ModbusError
from cdpr_drivers.modbus.tension import LoadCells, TensionSampler
from cdpr_profiles.errors import ProfileError
from cdpr_profiles.places import SHIPPED
from cdpr_profiles.tension_sensor import load_load_cells, load_tension_sensors
from cdpr_rt.core.clock import PacedClock
from cdpr_sim_bus.physics_board import PlatformState
from tests.drivers.modbus.load_cell_rig import LoadCellRig

# the sensor in a separate process answers within 0.05 s of wall-clock time
pytestmark = pytest.mark.alone
CLOCK = PacedClock()
SHIPPED_FILE = SHIPPED / "tension_sensors" / "rtu-inclinometer.toml"
EXACT = "tilt_noise_rad = 0.0\ntilt_zero_spread_rad = 0.0\n"


def turn(rig: LoadCellRig, rotation: Rotation) -> None:
    """Put the platform of the rig's board into an orientation."""
    rows = tuple(rotation.as_matrix().ravel().tolist())
    rig.board.platform.publish(PlatformState(rig.time_s, (0.0,) * 3, rows, (0.0,) * 3, (0.0,) * 3))


@pytest.mark.parametrize("angles", ["roll-pitch", "inclinations"])
def test_the_upward_direction_is_that_of_the_platform(tmp_path: Path, angles: str) -> None:
    mounted = f'[inclinometer]\nangles = "{angles}"\nmounting_rad = [0.2, -0.1, 1.5]'
    text = SHIPPED_FILE.read_text().replace("[inclinometer]", mounted, 1)
    text = text.replace("address = 0", "address = 6").replace("e-5", "e-5\nzero_rad = 0.01", 1)
    file, plant = tmp_path / "tilt.toml", tmp_path / "plant.toml"
    file.write_text(text)
    plant.write_text(EXACT)
    profile = load_tension_sensors(file)
    with LoadCellRig(file, tmp_path, 1, "--plant", str(plant)) as rig:
        cells = LoadCells(profile, rig.port, CLOCK)
        assert profile.inclinometer is not None
        for vector in ((0.0, 0.0, 0.0), (0.2, -0.15, 0.7), (-0.3, 0.1, 2.0)):
            rotation = Rotation.from_rotvec(vector)
            turn(rig, rotation)
            expected = rotation.inv().apply([0.0, 0.0, 1.0])
            assert cells.upward(profile.inclinometer) == pytest.approx(expected, abs=2e-5)
        cells.close()


def test_a_silent_inclinometer_has_no_valid_reading(tmp_path: Path) -> None:
    profile = load_tension_sensors("rtu-inclinometer")
    with (
        LoadCellRig("rtu-inclinometer", tmp_path, 1) as rig,
        TensionSampler(profile, rig.port, CLOCK) as sampler,
    ):
        turn(rig, Rotation.from_rotvec([0.1, 0.0, 0.0]))
        upward = sampler.exchange.feedback.upward
        sampler.exchange.update()
        assert upward[0] < 0.0  # nothing was read yet
        sampler.await_readings(5.0)
        sampler.exchange.update()
        assert upward[0] > 0.0
        rig.tell("silent 20")
        assert CLOCK.wait(lambda: bool(sampler.tilt_error), CLOCK.now_s + 5.0)
        CLOCK.sleep(profile.stale_after_s + 0.1)
        sampler.exchange.update()
        assert upward[0] < 0.0
        rig.tell("mend 20")
        assert CLOCK.wait(lambda: not sampler.tilt_error, CLOCK.now_s + 5.0)
        sampler.exchange.update()
        assert upward[0] > 0.0
        assert np.linalg.norm(upward[1:]) == pytest.approx(1.0)


def test_waiting_for_a_missing_inclinometer_names_it(tmp_path: Path) -> None:
    profile = load_tension_sensors("rtu-inclinometer")
    with (
        LoadCellRig("rtu-inclinometer", tmp_path, 1, "--fault", "silent 20") as rig,
        TensionSampler(profile, rig.port, CLOCK) as sampler,
        pytest.raises(ModbusError, match=r"unit 20|inclinometer"),
    ):
        sampler.await_readings(0.5)


@pytest.mark.parametrize(
    ("old", "new", "says"),
    [
        ("scale_rad = 1.7453292519943296e-5", "scale_rad = 0.0", "scale_rad: value 0"),
        ("address = 0", "address = 65535", "allowed: up to 65534"),
        ("[inclinometer]", "[amplifier]\nhighest_N = 1.0\n[inclinometer]", "amplifier"),
    ],
)
def test_a_file_that_cannot_be_used_names_key_and_value(
    tmp_path: Path, old: str, new: str, says: str
) -> None:
    file = tmp_path / "tilt.toml"
    file.write_text(SHIPPED_FILE.read_text().replace(old, new, 1))
    with pytest.raises(ProfileError, match=says):
        load_tension_sensors(file)


def test_commands_for_load_cells_reject_a_file_without_any() -> None:
    with pytest.raises(ProfileError, match="one or more load cells"):
        load_load_cells("rtu-inclinometer")
