"""The groups `cdpr drive`, `cdpr robot` and `cdpr sim`: their commands are loaded on demand."""

from __future__ import annotations

import typer

from cdpr_tools.command_group import lazy_group

DRIVE = {
    "drive": {
        "info": "Show the drive's identity and state; reads only.",
        "enable": "Enable the drive in torque mode without torque for a while, then switch it off.",
        "reset": "Acknowledge the drive's fault; the power stays off.",
        "home": "Find the encoder index by homing; the motor turns by up to a turn.",
        "jog": "Turn the motor at a constant speed under the PID, then switch it off.",
        "od": "Read or write an object of the drive's dictionary.",
        "configure": "Write the configuration of the profile to the drive; nothing is enabled.",
        "errors": "Show the drive's stored errors (1003h), newest first; reads only.",
    },
    "drive_setup": {
        "lss": "Find drives by LSS (CiA 305) and set a node id and bit rate.",
    },
    "drive_import": {
        "import": "Make a drive profile from an EDS or DCF file, and list what is missing.",
    },
}

ROBOT = {
    "robot": {
        "show": "Show a robot's platform, cables and workspace, and check whether it can work.",
        "mark-calibrated": "Confirm the geometry in the robot's file, e.g. after moving a rail.",
        "pose": "Compute poses from a table of cable lengths, and their errors.",
        "new": "Write a robot's file by answering questions.",
        "import": "Write a robot's file from a CASPR model.",
    },
    "robot_trial": {
        "trial": "Try a robot in simulation and judge its accuracy against the truth.",
    },
    "robot_workspace": {
        "workspace": "Compute where the cables can hold the platform.",
    },
}

SIM = {
    "sim_up": {
        "up": "Run simulated drives until Ctrl-C.",
    },
    "sim_devices": {
        "safety-io": "Run a simulated safety I/O until Ctrl-C.",
        "panel": "Press or release the emergency stop of a simulated safety I/O, or break it.",
        "rail": "Run a simulated rail until Ctrl-C; prints a line when it is ready.",
    },
    "sim_fault": {
        "fault": "Break a running simulated robot: a cable, an encoder, a drive; or mend it.",
    },
    "sim_campaign": {
        "campaign": "Play random user actions and faults on simulated robots, and judge how the "
        "robots react.",
    },
    "sim_camera": {
        "camera": "Run a camera on a simulated platform until Ctrl-C; other commands use it as "
        "sim:SOCKET.",
        "photos": "Write images of a simulated camera from random poses, and its intrinsics.",
    },
    "sim_tension": {
        "tension": "Run simulated load cells on a pseudo-terminal until Ctrl-C; prints its path "
        "when ready.",
        "hang": 'Hang a mass on a simulated cable whose plant has load.kind = "hung_mass".',
    },
    "sim_verify": {
        "verify": "Run a command several times on simulated drives and compare all files.",
    },
}

app = typer.Typer()
app.add_typer(lazy_group("drive", "Set up and try one drive.", DRIVE))
app.add_typer(
    lazy_group("robot", "Describe a cable robot, check it, and try it in simulation.", ROBOT)
)
app.add_typer(lazy_group("sim", "Simulate drives, robots, cameras and faults.", SIM))
