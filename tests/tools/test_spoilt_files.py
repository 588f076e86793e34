"""Damaged files are either used or rejected with our message."""

from __future__ import annotations

import json
import random
import re
import shutil
import time
from collections.abc import Callable
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, seed, settings
from hypothesis import strategies as st

from cdpr_drivers.errors import DriverError
from cdpr_drivers.robot.commissioned import load_profile
from cdpr_drivers.robot.robot_buses import require_fit
from cdpr_profiles import load_motor, load_robot
from cdpr_profiles.eds import load_dictionary
from cdpr_profiles.errors import ProfileError
from cdpr_profiles.motor import Motor
from cdpr_profiles.motor_bounds import MotorBounds
from cdpr_profiles.places import SHIPPED
from cdpr_profiles.rail import load_rail
from cdpr_profiles.reader import dotted
from cdpr_profiles.safety_io import load_safety_io
from cdpr_profiles.tension_sensor import load_tension_sensors
from cdpr_profiles.winch_calibration import WinchCalibration
from cdpr_rt.control.tuning import design_pid
from cdpr_rt.errors import ControlError, InvalidRequestError
from cdpr_rt.identification.commissioning_results import Paths, read_run, recording
from cdpr_rt.identification.rawlog import RawLogWriter, column_names, read_raw_log
from cdpr_rt.model.last_lengths import LastLengths
from cdpr_rt.model.robot_arrays import described, limits_of, winches_of
from cdpr_sim_bus.canopen.od import ObjectDictionary
from cdpr_sim_bus.cia402.drive import SimDrive
from cdpr_sim_bus.devices.sim_load_cells import AmplifierPlant
from cdpr_sim_bus.devices.sim_safety_io import SafetyPlant
from cdpr_sim_bus.errors import SimulatorError
from cdpr_sim_bus.robot.plant import Plant
from cdpr_sim_bus.robot.robot_plant import RobotPlant
from cdpr_tools.commission.page import bus_facts
from cdpr_tools.errors import CommandError
from cdpr_tools.recordings.stored_settings import load_settings
from cdpr_tools.rendering import number
from cdpr_tools.teleop.script import read_script
from cdpr_tools.trials.trial import TrialSettings
from tests.profiles.test_robot_limits import calibration
from tests.tools.motor_profiles import profile_of

OURS = (ControlError, DriverError, ProfileError, SimulatorError, CommandError)
CPU_S = 1.0
LONGEST_CHARS = 3000
SEED = 20260101
HOSTILE = (
    *("nan", "inf", "-inf", "NaN", "Infinity", "1e999", "-1e999", "1e308", "-1e308", "1e-320"),
    *("0", "-0.0", "-1", "1e6", "-1e6", "1e30", "4294967296", "9" * 30, "1" * 6000),
    *("true", "null", '""', '"x"', '"\x1b[2J"', "[]", "{}", "0x" + "f" * 90),
    *("[" * 3000, "{a=" * 3000, "]" * 3000, ".a" * 3000, "[a" + ".a" * 3000 + "]", "a" * 3000),
    *("\x00", "\n", '"""', "'", "\\", "#", ",", "=", "é", "1979-05-27T07:32:00Z", "$NODEID+0x180"),
    *("../../etc/passwd", "/dev/zero", "~nobody/x.toml", "\\u0000.toml"),
)
NUMBER = re.compile(rb"-?[0-9][0-9.e+-]*")
LINE = re.compile(rb"[^\n]*\n")


@dataclass(frozen=True)
class Kind:
    """A kind of file: its path and its reader."""

    path: Path
    use: Callable[[], object]


def spoil(data: bytes, rng: random.Random) -> bytes:
    """Return the content of a file with one to three changes."""
    for _ in range(rng.choice((1, 1, 1, 2, 3))):
        token = rng.choice(HOSTILE).encode("utf-8")
        spans = [m.span() for m in NUMBER.finditer(data)]
        lines = [m.span() for m in LINE.finditer(data)]
        what = rng.randrange(8)
        at = rng.randrange(len(data) + 1)
        if what <= 2 and spans:
            low, high = rng.choice(spans)
        elif what == 3 and lines:
            low, high = rng.choice(lines)
            token = data[low:high] * rng.choice((0, 2, 300))
        elif what == 4:
            low, high = at, min(len(data), at + rng.choice((1, 10, 1000)))
            token = rng.randbytes(high - low)
        elif what == 5:
            low, high, token = at, len(data), b""
        else:
            low, high = at, at
        data = data[:low] + token + data[high:]
    return data


def use_robot(path: Path) -> None:
    robot = load_robot(path)
    require_fit(robot)
    described(limits_of(robot), len(robot.axes))
    winches_of(robot.axes)


def use_lengths(path: Path) -> None:
    last = LastLengths(path)
    last.load(3, 3.0)
    if last.lengths is None:
        assert last.why
    else:
        assert (last.lengths.cable_length_m > 0.0).all()
        assert np.isfinite(last.lengths.cable_length_m).all()


def tell_of_run(run: dict[str, Any]) -> None:
    assert all(number(value) for key, value in run["pid"][0].items() if key != "gains")
    assert all(number(value) for value in run["pid"][0]["gains"].values())
    assert bus_facts(run["bus"])


def use_store(path: Path) -> None:
    SimDrive(SHIPPED / "drives" / "generic-cia402.eds", 1, Plant(), store=path).close()


def toml_of(motor: Motor) -> str:
    lines = (f"{k} = {json.dumps(v)}" for k, v in motor.model_dump().items() if v is not None)
    return "\n".join(lines) + "\n"


def raw_log(path: Path) -> Path:
    names = column_names(1)
    meta = {"period_s": 0.01, "measured_from_s": 0.0, "measured_until_s": 1.0, "first_cycle": 0}
    log = RawLogWriter(path, names, meta)
    log.write(np.ones((60, len(names))))
    log.close()
    return path


def profiles(folder: Path) -> dict[str, Kind]:
    """Write a robot's file and all files that it names, from shipped ones."""
    for sub in ("robots", "winches", "drives", "cables", "safety_io", "tension_sensors", "rails"):
        for path in (SHIPPED / sub).iterdir():
            shutil.copy(path, folder / path.name)
    (folder / "my-motor.toml").write_text(toml_of(load_motor("MPP0923D")))
    winch = folder / "winch-mpp0923d.toml"
    winch.write_text(winch.read_text().replace('"MPP0923D"', '"my-motor"'))
    robot, known, eds = (
        folder / name for name in ("planar-3.toml", "known.toml", "generic-cia402.eds")
    )
    known.write_text(calibration().to_toml())
    text = robot.read_text().replace("node_id = 1", 'node_id = 1\ncalibration = "known.toml"')
    robot.write_text(text)
    sensors, io, rail = "rtu-load-cells-8.toml", "modbus-remote-io.toml", "rail-modbus.toml"
    of_robot = {
        "robot": robot, "winch": winch, "motor": folder / "my-motor.toml",
        "drive": folder / "generic-cia402.toml", "cable": folder / "dyneema-4.8mm.toml",
        "calibration": known,
    }  # fmt: skip
    return {
        **{name: Kind(path, lambda: use_robot(robot)) for name, path in of_robot.items()},
        "calibration alone": Kind(known, lambda: WinchCalibration.load_file(known)),
        "tension sensors": Kind(folder / sensors, lambda: load_tension_sensors(folder / sensors)),
        "safety I/O": Kind(folder / io, lambda: load_safety_io(folder / io)),
        "rail": Kind(folder / rail, lambda: load_rail(folder / rail)),
        "EDS, the master's": Kind(eds, lambda: load_dictionary(eds, 5)),
        "EDS, the simulator's": Kind(eds, lambda: ObjectDictionary.from_eds(eds, 5)),
    }


def written(folder: Path) -> dict[str, Kind]:
    """Write output files of commands, and scripts for them."""
    winch = load_robot(folder / "planar-3.toml").axes[0].winch
    cogging, lengths, store, asked, script = (
        folder / name
        for name in (
            "cogging-profile.json", "lengths.json", "store.json", "trial.json", "script.txt",
        )
    )  # fmt: skip
    profile_of(winch, Plant(), 1).save(cogging)
    at_index = [0.1, None, 0.2]
    stopped = {"stopped": True, "date": "2026", "cable_length_m": [1.0, 2.0, 3.0]}
    lengths.write_text(json.dumps({**stopped, "cable_at_index_m": at_index}))
    store.write_text('{"node_id": 5, "bitrate": 500000, "values": {"101700": 100}}')
    run = Paths(folder).run
    run.write_text(json.dumps({
        "winch": "w", "date": "2026", "drive": {"serial": 1}, "encoder_counts_per_turn": 8192,
        "rated_torque_Nm": 3.0, "inertia_kg_m2": 1e-4, "latency_s": 2e-3, "bandwidth_Hz": 12.0,
        "bandwidths_Hz": [12.0], "pid": [asdict(design_pid(1e-4, 2e-3, 12.0, 1e-3))],
        "bus": {"url": "simbus:", "period_s": 1e-3, "cycles": 5000, "wall_s": 2.5},
    }))  # fmt: skip
    asked.write_text(json.dumps(asdict(TrialSettings("line", "r", None, 1, 2.0, None, True))))
    script.write_text("0 0 0 clutch\n1.5 10 -20\n2 20 0 confirm\n")
    raw = raw_log(folder / "pass.raw")
    return {
        "cogging profile": Kind(cogging, lambda: load_profile(cogging, MotorBounds(winch.motor))),
        "lengths": Kind(lengths, lambda: use_lengths(lengths)),
        "stored parameters": Kind(store, lambda: use_store(store)),
        "run": Kind(run, lambda: tell_of_run(read_run(Paths(folder)))),
        "trial": Kind(asked, lambda: load_settings(asked, TrialSettings)),
        "script": Kind(script, lambda: read_script(script)),
        "raw log": Kind(raw, lambda: recording(read_raw_log(raw))),
    }


def plants(folder: Path) -> dict[str, Kind]:
    """Write the plant files of the simulator."""
    plant, robot_plant = folder / "plant.toml", folder / "robot-plant.toml"
    plant.write_text(
        "seed = 3\n[motor]\ninertia_kg_m2 = 1e-4\n[[cogging]]\norder = 4\namplitude_Nm = 0.06\n"
        "[friction]\ncoulomb_Nm = 0.08\n[load]\nkind = 'hung_mass'\nmass_kg = 5.0\n"
        "[limits]\nnegative_deg = -90.0\n"
    )
    robot_plant.write_text(
        "seed = 3\n[geometry]\nexit_errors_m = [[0.0, 0.01], [0.0, 0.0], [0.0, 0.0]]\n"
        "[platform]\ncentre_of_mass_m = [0.0, 0.1]\n[start]\nposition_m = [0.0, 1.3]\n"
        "[floor]\nheight_m = 1.2\n[motor.friction]\ncoulomb_Nm = 0.08\n"
    )
    safety, tension = folder / "safety-plant.toml", folder / "tension-plant.toml"
    safety.write_text("")
    tension.write_text("")
    return {
        "plant": Kind(plant, lambda: Plant.load_file(plant)),
        "robot's plant": Kind(robot_plant, lambda: RobotPlant.load_file(robot_plant)),
        "safety plant": Kind(safety, lambda: SafetyPlant.load_file(safety)),
        "tension plant": Kind(tension, lambda: AmplifierPlant.load_file(tension)),
    }


@pytest.fixture(scope="module")
def kinds(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Kind]:
    """Return a valid file of each kind that has been read once."""
    folder = tmp_path_factory.mktemp("files")
    found = {**profiles(folder), **written(folder), **plants(folder)}
    for kind in found.values():
        kind.use()
    return found


NAMES = (
    *("robot", "winch", "motor", "drive", "cable", "calibration", "calibration alone"),
    *("cogging profile", "lengths", "stored parameters", "run", "trial", "script"),
    *("plant", "robot's plant", "safety plant", "tension plant", "tension sensors", "safety I/O"),
    *("rail", "EDS, the master's", "EDS, the simulator's", "raw log"),
)


def refused(kind: Kind) -> str:
    """Use a file. Return why it was rejected, "" if it was not."""
    began = time.process_time()
    reason = ""
    try:
        kind.use()
    except OURS as error:
        reason = str(error)
        assert reason
    # processor time, which does not depend on the load of the machine
    assert time.process_time() - began < CPU_S
    assert len(reason) < LONGEST_CHARS
    assert "\x1b" not in reason
    return reason


@pytest.mark.parametrize("name", NAMES)
@seed(SEED)
@settings(max_examples=25, database=None)
@given(number=st.integers(0, 2**32 - 1))
def test_a_damaged_file_is_used_or_rejected(kinds: dict[str, Kind], name: str, number: int) -> None:
    kind = kinds[name]
    sound = kind.path.read_bytes()
    try:
        kind.path.write_bytes(spoil(sound, random.Random(number)))
        refused(kind)
    finally:
        kind.path.write_bytes(sound)


@pytest.mark.parametrize(
    ("keys", "value"),
    [
        (("pid", 0, "phase_margin_deg"), "5"),
        (("pid", 0, "sensitivity_peak"), None),
        (("pid", 0), {}),
        (("pid",), []),
        (("drive",), "mine"),
        (("drive", "vendor_id"), "7"),
        (("drive", "revision"), -1),
        (("bus", "cycles"), 1.5),
        (("bus", "wall_s"), "2"),
        (("torque_step_Nm",), "2"),
    ],
)
def test_error_of_a_report_names_the_invalid_key_of_its_run(
    kinds: dict[str, Kind], keys: tuple[str | int, ...], value: object
) -> None:
    path = kinds["run"].path
    sound = path.read_bytes()
    table = inner = json.loads(sound)
    for key in keys[:-1]:
        inner = inner[key]
    inner[keys[-1]] = value
    try:
        path.write_text(json.dumps(table))
        with pytest.raises(InvalidRequestError, match=re.escape(f"{path}: {dotted(keys)}")):
            read_run(Paths(path.parent))
    finally:
        path.write_bytes(sound)
