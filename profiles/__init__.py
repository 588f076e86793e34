"""Motors, drives, winches, cables and robots as validated data."""

from profiles.cable import Cable
from profiles.catalogue import (
    list_profiles,
    load_all,
    load_cable,
    load_drive,
    load_machine,
    load_motor,
    load_motor_ratings,
    load_robot,
    load_winch,
)
from profiles.drive import DriveProfile, Pdo, PdoEntry
from profiles.errors import ProfileError
from profiles.motor import Motor, MotorRatings
from profiles.robot import Robot, RobotAxis, RobotBus
from profiles.robot_limits import RobotLimits
from profiles.winch import Winch

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
    "load_machine",
    "load_motor",
    "load_motor_ratings",
    "load_robot",
    "load_winch",
]
