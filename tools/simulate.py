"""`cdpr_rt.simulate`: a robot on simulated drives for a script."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Final

from cdpr_profiles.platform import NO_PLATFORM
from cdpr_rt.robot import InvalidArgument, Robot, path_of
from cdpr_tools.loading import without_collection

if TYPE_CHECKING:
    from cdpr_rt.model.own_distribution import TensionDistribution
    from cdpr_rt.platform.own_controller import Controller
    from cdpr_rt.programs.own_program import Program

_LOG_S: Final = 300.0


def simulate(
    robot: str | Path,
    *,
    plant: str | Path | None = None,
    controller: Controller | None = None,
    tension_distribution: TensionDistribution | None = None,
    programs: Sequence[Program] = (),
    allow_code: bool = False,
) -> Robot:
    """Return a robot on simulated drives in this process, ready and without power.

    `robot` is the name or file of a robot, `plant` is a file that describes how the simulated
    machine deviates from that robot. `controller` replaces the built-in controller of the platform,
    `tension_distribution` the tension distribution that the robot's file names. `programs` are
    further programs for `Robot.run`. If the robot's file names code, `allow_code` allows it from
    now on. Bus time passes only while a method waits, as fast as this machine computes: the same
    script gives the same rows. Use the handle from one thread. Closing it removes the power. Raises
    InvalidRobot, and Error if the drives do not get ready.
    """
    plant_file = None if plant is None else path_of("plant", plant)
    if plant_file is not None and not plant_file.is_file():
        raise InvalidArgument(f"plant: {plant_file}: no such file")
    with without_collection():
        # imported here, because collection of garbage would take a tenth of the time
        from cdpr_rt.model.own_distribution import (  # noqa: PLC0415
            checked_distribution,
            require_code_allowed,
        )
        from cdpr_tools.client.handle_errors import errors_for_scripts  # noqa: PLC0415
        from cdpr_tools.composition.own_code import OwnCode  # noqa: PLC0415
        from cdpr_tools.lockstep_robot import LockstepRobot  # noqa: PLC0415

        with errors_for_scripts(opening=True):
            _require_objects(controller, programs)
            if tension_distribution is not None:
                checked_distribution("tension_distribution", tension_distribution)
            named = [(f"programs[{i}]", program) for i, program in enumerate(programs)]
            own = OwnCode(controller, tension_distribution, named)
            made = LockstepRobot(robot, plant=plant_file, own=own, ring_s=_LOG_S)
            for name, given in vars(own).items():
                if given and made.robot.platform is None:
                    raise InvalidArgument(f"{name}: {robot} {NO_PLATFORM}")
            if allow_code:
                require_code_allowed(made.robot, allow_code=True)
            return Robot(made.__enter__())


def _require_objects(controller: object, programs: object) -> None:
    """Raise InvalidArgument if the user's controller or programs have the wrong type."""
    from cdpr_rt.platform.own_controller import Controller  # noqa: PLC0415  # see above

    if controller is not None and not isinstance(controller, Controller):
        raise InvalidArgument(
            f"controller: {controller!r}; give an object of a class derived from cdpr_rt.Controller"
        )
    if not isinstance(programs, Sequence) or isinstance(programs, str):
        raise InvalidArgument(f"programs: {programs!r}; give a list of programs")
