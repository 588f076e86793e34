"""`cdpr robot`: describe a cable robot, look at it, try it."""

from __future__ import annotations

from cdpr_tools.command_group import lazy_group

MODULES = {
    "robot.robot": {
        "show": "Show a robot's platform, cables and workspace, and check whether it can work.",
        "mark-calibrated": "Say that a robot's geometry is as its file has it, as after its rails "
        "were moved.",
        "new": "Ask what is to be known of a cable robot, and write its file.",
    },
    "robot.robot_trial": {
        "trial": "Try a robot on a simulator of its own; the figures come from what was recorded "
        "and true.",
    },
    "robot.robot_workspace": {
        "workspace": "Search where the cables can hold a robot's platform, by a grid and by rays "
        "from a centre.",
    },
}

app = lazy_group("robot", "Describe a cable robot, look at it, try it.", MODULES)
