"""Names for `from cdpr_profiles import ...`."""

from cdpr_profiles.cable import Cable
from cdpr_profiles.catalogue import (
    list_profiles,
    load_all,
    load_cable,
    load_drive,
    load_motor,
    load_motor_ratings,
    load_robot,
    load_winch,
    load_winch_or_robot,
)
from cdpr_profiles.drive import DriveProfile, Pdo, PdoEntry
from cdpr_profiles.errors import ProfileError
from cdpr_profiles.motor import Motor, MotorRatings
from cdpr_profiles.robot import Robot, RobotAxis, RobotBus
from cdpr_profiles.robot_limits import RobotLimits
from cdpr_profiles.winch import Winch

__all__ = [
    "Cable",
    "DriveProfile",
    "Motor",
    "MotorRatings",
    "Pdo",
    "PdoEntry",
    "ProfileError",
    "Robot",
    "RobotAxis",
    "RobotBus",
    "RobotLimits",
    "Winch",
    "list_profiles",
    "load_all",
    "load_cable",
    "load_drive",
    "load_motor",
    "load_motor_ratings",
    "load_robot",
    "load_winch",
    "load_winch_or_robot",
]
