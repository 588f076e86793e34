"""`cdpr drive`: one drive on the bus."""

from __future__ import annotations

from cdpr_tools.command_group import lazy_group

MODULES = {
    "drive.drive": {
        "info": "Show the drive's identity and state; reads only.",
        "enable": "Enable the drive in torque mode without torque for a while, then switch it off.",
        "reset": "Acknowledge the drive's fault; nothing is enabled by it.",
        "home": "Find the encoder index by homing; the motor turns by up to a turn.",
        "jog": "Turn the motor at a constant speed under the PID, then switch it off.",
        "od": "Read or write an object of the drive's dictionary.",
        "configure": "Write into the drive what differs from its profile; nothing is enabled.",
        "errors": "Show the errors that a drive remembers (1003h), the newest first; reads only.",
    },
    "drive.drive_setup": {
        "lss": "Find drives by LSS (CiA 305) and give one a node id and a bit rate.",
    },
    "drive.drive_import": {
        "import": "Make a drive profile from an EDS or DCF, and list what it could not know.",
    },
}

app = lazy_group("drive", "One drive on the bus.", MODULES)
