"""Controller of cable-driven parallel robots, and the Python interface to run one.

    import cdpr_rt as cdpr

    with cdpr.simulate("planar-3") as robot:
        robot.enable()
        robot.tighten()
        robot.move_to([0.3, 2.0])

`simulate`, `connect` and `run` return a `Robot`. They need simulator, drivers and daemon, which the
controller itself does not import: names are loaded when they are first used. `load` returns the
`Model` of a robot for offline work. `commission` measures a motor, `calibrate` a robot's geometry.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from cdpr_rt.model.own_distribution import TensionDistribution
    from cdpr_rt.offline import Model, load
    from cdpr_rt.platform.own_controller import Controller, State, Target, TorqueController
    from cdpr_rt.programs.own_program import Program
    from cdpr_rt.robot import (
        AlreadyRunning,
        Error,
        Faulted,
        InvalidArgument,
        InvalidRobot,
        Log,
        MotionEnded,
        NotRunning,
        Refused,
        Robot,
    )
    from cdpr_tools.calibrate.calibrate_robot import calibrate
    from cdpr_tools.client.daemon_robot import connect, run
    from cdpr_tools.commission.run import commission
    from cdpr_tools.simulate import simulate

__all__ = [
    "AlreadyRunning",
    "Controller",
    "Error",
    "Faulted",
    "InvalidArgument",
    "InvalidRobot",
    "Log",
    "Model",
    "MotionEnded",
    "NotRunning",
    "Program",
    "Refused",
    "Robot",
    "State",
    "Target",
    "TensionDistribution",
    "TorqueController",
    "calibrate",
    "commission",
    "connect",
    "load",
    "run",
    "simulate",
]

_HOMES = {
    "Controller": "cdpr_rt.platform.own_controller",
    "Model": "cdpr_rt.offline",
    "calibrate": "cdpr_tools.calibrate.calibrate_robot",
    "commission": "cdpr_tools.commission.run",
    "connect": "cdpr_tools.client.daemon_robot",
    "load": "cdpr_rt.offline",
    "Program": "cdpr_rt.programs.own_program",
    "run": "cdpr_tools.client.daemon_robot",
    "simulate": "cdpr_tools.simulate",
    "State": "cdpr_rt.platform.own_controller",
    "Target": "cdpr_rt.platform.own_controller",
    "TensionDistribution": "cdpr_rt.model.own_distribution",
    "TorqueController": "cdpr_rt.platform.own_controller",
}
"""Modules of these names; all others are in `cdpr_rt.robot`."""


def __getattr__(name: str) -> Any:
    if name not in __all__:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    home = _HOMES.get(name, "cdpr_rt.robot")
    value = globals()[name] = getattr(import_module(home), name)
    return value


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
