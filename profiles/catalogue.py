"""Find profiles by name or path and load them with the profiles they name."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from functools import lru_cache
from pathlib import Path
from typing import TypeVar

from cdpr_profiles import places
from cdpr_profiles.bounded_input import is_file, path_of, read_toml, resolved
from cdpr_profiles.cable import Cable, CableSeries
from cdpr_profiles.drive import DriveProfile
from cdpr_profiles.errors import ProfileError
from cdpr_profiles.motor import Motor, MotorRatings, MotorSeries
from cdpr_profiles.motor_bounds import MOST_SPEED_RATIO
from cdpr_profiles.platform import CLEARANCE_m, Platform
from cdpr_profiles.rail import Cia402Rail, load_rail
from cdpr_profiles.reader import read_toml_model
from cdpr_profiles.robot import (
    Robot,
    RobotAxis,
    RobotFile,
    default_name,
    robot_of_winch,
    with_heartbeat_timeout,
)
from cdpr_profiles.safety_io import load_safety_io
from cdpr_profiles.tension_sensor import load_tension_sensors
from cdpr_profiles.winch import Winch, WinchFile
from cdpr_profiles.winch_calibration import WinchCalibration

_T = TypeVar("_T")


def load_motor(name: str | Path, beside: Path | None = None) -> Motor:
    """Return a motor by name ("MPP0923D") or path; the folder `beside` is searched first.

    Raises ProfileError, also for a motor whose source has only its ratings.
    """
    path = places.find("motors", name, beside)
    if path is not None:
        return read_toml_model(path, Motor)
    for series_path, series in _motor_series().items():
        if str(name) in series.names():
            motor = series.motor(str(name))
            if motor is not None:
                return motor
            raise ProfileError(
                series_path,
                f"detail.{str(name)[3:]}",
                f"the data sheet has only the ratings of {name}, not its torque constant and "
                "winding; write a motor file with these values",
            )
    raise places.unknown_profile("motors", name, beside, _names("motors"))


def load_motor_ratings(name: str) -> MotorRatings:
    """Return the printed ratings of a motor of a shipped series; raises ProfileError."""
    for series in _motor_series().values():
        if name in series.names():
            return series.names()[name]
    raise places.unknown_profile("motors", name, more=_names("motors"))


def load_drive(name: str | Path, beside: Path | None = None) -> DriveProfile:
    """Return a drive by name or path; `eds` is an existing absolute path. Raises ProfileError."""
    path = places.require("drives", name, beside)
    drive = read_toml_model(path, DriveProfile)
    eds = path.parent / drive.eds
    if not is_file(eds):
        raise ProfileError(
            path, "eds", f"no file {str(drive.eds)!r} beside this one; copy it there"
        )
    return drive.model_copy(update={"eds": resolved(eds)})


def load_rail_drive(name: str | Path, rail: Cia402Rail) -> DriveProfile:
    """Return the drive named in a rail's file, searched beside it first; raises ProfileError."""
    return load_drive(rail.drive, places.require("rails", name).parent)


def load_cable(name: str | Path, beside: Path | None = None) -> Cable:
    """Return a cable by name or path; raises ProfileError."""
    return read_toml_model(places.require("cables", name, beside), Cable)


def load_winch(name: str | Path, beside: Path | None = None) -> Winch:
    """Return a winch by name or path, with the motor, drive and cable that its file names.

    These are searched beside the winch's file first. Raises ProfileError.
    """
    path = places.require("winches", name, beside)
    file = read_toml_model(path, WinchFile)
    folder = path.parent
    if file.node_id == file.master_node_id:
        raise ProfileError(
            path, "node_id", f"value {file.node_id}; allowed: any but master_node_id"
        )
    return Winch(
        profile=path.stem,
        path=resolved(path),
        motor=_load_reference(path, "motor", load_motor, file.motor, folder),
        drive=_load_reference(path, "drive", load_drive, file.drive, folder),
        cable=_load_reference(path, "cable", load_cable, file.cable, folder),
        **file.model_dump(exclude={"motor", "drive", "cable"}),
    )


def load_robot(name: str | Path) -> Robot:
    """Return a robot by name or path, with the winches that its file names; raises ProfileError.

    The winches are searched beside the robot's file first. If `name` is that of a winch, the
    robot has this winch as its only axis.
    """
    path = places.find("robots", name)
    if path is None or "motor" in read_toml(path):
        if places.find("winches", name) is None:
            raise places.unknown_profile("robots", name, None, _names("winches"))
        return robot_of_winch(load_winch(name))
    file = read_toml_model(path, RobotFile)
    _raise_faults(path, list(file.faults()))
    axes = _axes(path, file)
    _raise_faults(path, list(_limit_faults(file, axes)))
    return Robot(
        profile=path.stem,
        path=resolved(path),
        axes=tuple(axes),
        safety_io=_device(path, "safety_io", load_safety_io, file.safety_io),
        tension_sensors=_tension_sensors(path, file),
        rails=tuple(_beside(path, name) for name in file.rails),
        **{
            key: getattr(file, key)
            for key in RobotFile.model_fields
            if key not in ("axes", "safety_io", "tension_sensors", "rails", "platform")
        },
        platform=_platform(file, axes),
    )


def _platform(file: RobotFile, axes: Sequence[RobotAxis]) -> Platform | None:
    if file.platform is None:
        return None
    values = {key: value for key, value in file.platform if value is not None}
    up = (*(0.0 for _ in file.platform.home_m[1:]), 1.0)
    values.setdefault("clearance_m", max(CLEARANCE_m, _thickest_m(axes)))
    hangs = file.platform.cable_model == "catenary"
    return Platform(
        **values,
        exit_points_m=tuple(axis.exit_point_m or () for axis in file.axes),
        anchor_points_m=tuple(axis.anchor_point_m or () for axis in file.axes),
        pulley_radius_m=tuple(axis.pulley_radius_m for axis in file.axes),
        cable_weights_N_m=tuple(
            axis.winch.cable.weight_per_length_N_m if hangs else 0.0 for axis in axes
        ),
        pulley_axes=tuple(axis.pulley_axis or up for axis in file.axes),
    )


def _thickest_m(axes: Sequence[RobotAxis]) -> float:
    return max(axis.winch.cable.diameter_m for axis in axes)


def _raise_faults(path: Path, faults: list[tuple[str, str]]) -> None:
    if faults:
        further = "".join(f"\n{path}: {key}: {problem}" for key, problem in faults[1:])
        raise ProfileError(path, faults[0][0], faults[0][1] + further)


def _axes(path: Path, file: RobotFile) -> list[RobotAxis]:
    """Return the axes; their winches take bit rate, cycle and node ids from the robot."""
    bitrates = {bus.name: bus.bitrate_bit_s for bus in file.buses}
    winches: dict[str, Winch] = {}
    axes = []
    for i, axis in enumerate(file.axes):
        if axis.winch not in winches:
            winches[axis.winch] = with_heartbeat_timeout(
                _load_reference(path, f"axes[{i}].winch", load_winch, axis.winch, path.parent),
                file.master_heartbeat_s,
            )
        winch = replace(
            winches[axis.winch],
            node_id=axis.node_id,
            master_node_id=file.master_node_id,
            bitrate_bit_s=bitrates[axis.bus],
            sync_period_s=file.sync_period_s,
            cable_sign=axis.cable_sign or winches[axis.winch].cable_sign,
        )
        name = axis.name or default_name(i)
        known = _calibration(path, i, axis.calibration, winch)
        commissioning = None if axis.commissioned is None else _path_from(path, axis.commissioned)
        axes.append(
            RobotAxis(winch, axis.bus, axis.node_id, axis.mandatory, name, known, commissioning)
        )
    return axes


def _calibration(robot: Path, axis: int, name: str | None, winch: Winch) -> WinchCalibration | None:
    """Return the calibration that an axis names; its path is relative to the robot's file."""
    if name is None:
        return None
    path = path_of(robot.parent, name)
    found = WinchCalibration.load_file(path)
    for key, problem in found.faults(winch):
        raise ProfileError(path, key, f"{problem} (axes[{axis}] of {robot.name})")
    return found


def _limit_faults(file: RobotFile, axes: Sequence[RobotAxis]) -> Iterator[tuple[str, str]]:
    """Yield (key, problem) for limits beyond the ratings of motors or cables."""
    for key, ratings, of in (
        ("torque_Nm", [a.winch.motor.peak_torque_Nm for a in axes], "the motor's peak torque"),
        (
            "speed_rad_s",
            [MOST_SPEED_RATIO * a.winch.motor.rated_speed_rad_s for a in axes],
            f"{MOST_SPEED_RATIO:g} times the motor's rated speed",
        ),
        ("tension_max_N", [a.winch.cable.breaking_force_N for a in axes], "the breaking force"),
    ):
        limits = getattr(file.limits, key) or ()
        for i, value in enumerate(limits):
            most = ratings[i] if len(limits) > 1 else min(ratings)
            if value > most:
                yield f"limits.{key}[{i}]", f"value {value:g}; allowed: up to {of} ({most:.6g})"
    clearance_m = file.platform and file.platform.clearance_m
    if clearance_m and clearance_m < _thickest_m(axes):
        allowed = f"allowed: the cables' diameter ({_thickest_m(axes):g}) and more"
        yield "platform.clearance_m", f"value {clearance_m:g}; {allowed}"


def _device(robot: Path, key: str, load: Callable[[str], object], name: str | None) -> str | None:
    """Return the reference to a device that a robot's file names; raises ProfileError."""
    if name is None:
        return None
    reference = _beside(robot, name)
    _load_reference(robot, key, load, reference)
    return reference


def _tension_sensors(robot: Path, file: RobotFile) -> str | None:
    """Return the reference to the load cells that a robot's file names; raises ProfileError."""
    key, axes = "tension_sensors", len(file.axes)
    reference = _device(robot, key, load_tension_sensors, file.tension_sensors)
    if reference is not None:
        count = len(load_tension_sensors(reference).sensors)
        if count > axes:
            named = f"{file.tension_sensors} has {count} sensors"
            raise ProfileError(robot, key, f"{named}; allowed: up to {axes}, one for each axis")
    return reference


def _beside(file: Path, name: str) -> str:
    """Return `name`; if it is a path relative to the folder of `file`, as an absolute path."""
    text, at, place = name.partition("@")
    if "/" not in text and not text.endswith(".toml"):
        return name
    return str(_path_from(file, text)) + at + place


def _path_from(file: Path, text: str) -> Path:
    """Return a path from a profile, which is relative to the profile's folder."""
    return resolved(path_of(file.parent, text))


def load_winch_or_robot(name: str | Path) -> Winch | Robot:
    """Return the robot or the winch of this name or path; raises ProfileError."""
    robot = places.find("robots", name, None)
    if robot is None:
        if places.find("winches", name, None) is None:
            unknown = places.unknown_profile("winches", name, None, _names("robots"))
            raise ProfileError("winches and robots", "", unknown.problem)
        return load_winch(name)
    if places.find("winches", name, None) == robot and not {"axes", "buses"} & set(
        read_toml(robot)
    ):
        return load_winch(name)
    return load_robot(name)


def list_profiles() -> dict[places.ProfileKind, tuple[str, ...]]:
    """Return the names of all profiles by kind, including every motor of a series."""
    return {kind: tuple(sorted(_names(kind))) for kind in places.KINDS}


def load_profile(kind: places.ProfileKind, name: str) -> object:
    """Return a profile by its kind and name; the ratings for a motor without a size sheet.

    Raises ProfileError.
    """
    if kind == "motors" and places.find(kind, name) is None:
        ratings = load_motor_ratings(name)
        return next(filter(None, (s.motor(name) for s in _motor_series().values())), ratings)
    return _LOADERS[kind](name)


def load_all() -> dict[str, dict[str, object]]:
    """Read and validate every profile that `list_profiles` names; raises ProfileError.

    This includes the sizes of a series of cables.
    """
    _motor_series.cache_clear()
    everything: dict[str, dict[str, object]] = {
        kind: {name: load_profile(kind, name) for name in _names(kind)} for kind in places.KINDS
    }
    for path in sorted((places.SHIPPED / "cables").glob("*" + places.SERIES)):
        everything["cables"] |= {s.code: s for s in read_toml_model(path, CableSeries).sizes}
    return everything


@lru_cache(maxsize=1)
def _motor_series() -> dict[Path, MotorSeries]:
    paths = sorted((places.SHIPPED / "motors").glob("*" + places.SERIES))
    return {path: read_toml_model(path, MotorSeries) for path in paths}


def _names(kind: places.ProfileKind) -> set[str]:
    names = {path.stem for path in places.profile_files(kind)}
    if kind == "motors":
        for series in _motor_series().values():
            names |= set(series.names())
    return names


def _load_reference(file: Path, key: str, load: Callable[..., _T], *named: str | Path) -> _T:
    """Load the profile that a key in `file` names; an error about that name gives file and key."""
    try:
        return load(*named)
    except ProfileError as error:
        if error.file in places.KINDS:
            raise ProfileError(file, key, error.problem) from None
        raise


_LOADERS: dict[places.ProfileKind, Callable[[str], object]] = {
    "motors": load_motor,
    "drives": load_drive,
    "cables": load_cable,
    "winches": load_winch,
    "robots": load_robot,
    "tension_sensors": load_tension_sensors,
    "safety_io": load_safety_io,
    "rails": load_rail,
}
