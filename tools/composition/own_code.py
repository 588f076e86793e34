"""The user's own code that a control loop runs."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from cdpr_profiles import Robot
from cdpr_profiles.platform import NO_PLATFORM
from cdpr_rt.code_loader import load_code, load_registered, require_file
from cdpr_rt.errors import ControlError
from cdpr_rt.model.own_distribution import (
    TensionDistribution,
    checked_distribution,
    named_distribution,
    require_code_allowed,
)
from cdpr_rt.platform.own_controller import Controller
from cdpr_rt.programs.own_program import PROGRAMS
from cdpr_tools.errors import BadInputError


@dataclass(frozen=True)
class OwnCode:
    """Code that replaces or extends built-in parts."""

    controller: Controller | None = None
    tension_distribution: TensionDistribution | None = None
    programs: Sequence[tuple[str, Any]] = ()
    """Further programs of a platform, each with its reference in messages."""


@dataclass(frozen=True)
class OwnCodeOptions:
    """Options of commands that name code: FILE.py:NAME or MODULE:NAME, None for nothing."""

    controller: str | None = None
    tension_distribution: str | None = None
    programs: tuple[str, ...] = ()

    def require_use(self, robot: Robot, *, allow_code: bool) -> None:
        """Raise BadInputError if code is missing or the robot has no use for it; run no code.

        Raises ProfileError if the robot's file names code that is not allowed; `allow_code` allows
        it from now on.
        """
        for option, reference in (
            ("--controller", self.controller),
            ("--tension-distribution", self.tension_distribution),
            *(("--program", program) for program in self.programs),
        ):
            if reference is None:
                continue
            if robot.platform is None:
                raise BadInputError(f"{option}: {robot.profile} {NO_PLATFORM}")
            try:
                require_file(reference)
            except ControlError as error:
                raise BadInputError(f"{option} {error}") from error
        if self.tension_distribution is None:
            require_code_allowed(robot, allow_code=allow_code)

    def load(self) -> OwnCode:
        """Run the code and return the named objects; raises BadInputError."""
        return OwnCode(
            None if self.controller is None else _controller(self.controller),
            None if self.tension_distribution is None else _distribution(self.tension_distribution),
            [_program(reference) for reference in self.programs],
        )

    def notices(self, robot: Robot) -> list[str]:
        """Return notes for operators: whose code controls the platform when it is off its stand."""
        named = "" if robot.platform is None else robot.platform.own_distribution
        distribution = self.tension_distribution or named
        return [
            *([f"{self.controller} controls the platform off its stand"] * bool(self.controller)),
            *([f"{distribution} distributes the tensions off the stand"] * bool(distribution)),
        ]


def _controller(reference: str) -> Controller:
    try:
        found = load_code(reference)
    except ControlError as error:
        raise BadInputError(f"--controller {error}") from error
    if isinstance(found, Controller):
        return found
    name = reference.rpartition(":")[2]
    also = "; a tension distribution is given with --tension-distribution" * callable(found)
    raise BadInputError(f"--controller {reference}: derive {name} from cdpr_rt.Controller{also}")


def _distribution(reference: str) -> TensionDistribution:
    try:
        return checked_distribution(reference, load_code(reference))
    except ControlError as error:
        raise BadInputError(f"--tension-distribution {error}") from error


def _program(reference: str) -> tuple[str, Any]:
    try:
        return f"--program {reference}", load_code(reference)
    except ControlError as error:
        raise BadInputError(f"--program {error}") from error


def completed(own: OwnCode, robot: Robot) -> OwnCode:
    """Return `own` with the distribution that the robot's file names and registered programs.

    A distribution of `own` takes precedence over that of the file. Raises ProfileError if the
    file's code is not allowed or fails, and CodeError if a package's code fails.
    """
    if robot.platform is None:
        return own
    distribution = own.tension_distribution or named_distribution(robot)
    registered = load_registered(PROGRAMS).items()
    return OwnCode(own.controller, distribution, [*own.programs, *registered])
