"""`cdpr poses`: draw poses that a robot can reach on a straight line without contact."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Annotated

import numpy as np
import typer

from cdpr_profiles.calibration_in_force import load_calibrated
from cdpr_profiles.platform import NO_PLATFORM
from cdpr_rt.arrays import FloatArray
from cdpr_rt.errors import GeometryError
from cdpr_rt.model.platform_model import PlatformModel, platform_model_of
from cdpr_rt.model.reachable import SHARE, Reach
from cdpr_tools.commands.options import JsonOption, PngOption, RobotArgument, SeedOption, option
from cdpr_tools.errors import BadInputError, os_error_as
from cdpr_tools.number_options import numbers, numbers_command
from cdpr_tools.output import Output
from cdpr_tools.robots.pose_choice import Choose, Chosen, checked_file, choose, write_poses

app = typer.Typer()

_SHOWN = 5


@app.command(cls=numbers_command("--from"))
def poses(
    robot: RobotArgument,
    count: Annotated[int, option("Number of poses.", "-n", "--count", min=1, max=100_000)] = 100,
    start: Annotated[
        str | None,
        option(
            "Start of the straight lines to the poses, in mm; default: home.",
            "--from",
            metavar="X Y [Z]",
        ),
    ] = None,
    seed: SeedOption = 1,
    by: Annotated[
        Choose,
        option(
            "Which poses to choose: as drawn, far from each other, or with most "
            "information about exit points and initial lengths.",
            "--choose",
        ),
    ] = Choose.RANDOM,
    angle: Annotated[
        float | None,
        option(
            "Largest rotation from home's orientation; default: the limit of targets.",
            min=0.0,
            max=179.0,
            metavar="DEG",
        ),
    ] = None,
    share: Annotated[
        float, option("Share to use of a way that is blocked before its target.", min=0.01, max=1.0)
    ] = SHARE,
    out_file: Annotated[
        Path | None, option("NAME.csv or NAME.toml, in m, rad.", "--out", metavar="FILE")
    ] = None,
    png: PngOption = None,
    as_json: JsonOption = False,
) -> None:
    """Draw random poses that a robot can reach.

    On the whole way the cables can hold the moving platform, and nothing comes into contact. This
    is proved for every place on the way, not only checked at samples. The command moves nothing.
    """
    out = Output(as_json)
    profile = load_calibrated(robot)
    if profile.platform is None:
        raise BadInputError(f"{profile.path}: {NO_PLATFORM}")
    if out_file is not None:
        checked_file(out_file)
    model = platform_model_of(profile)
    angle_rad = _angle_rad(model, angle)
    try:
        reach = Reach(model, _start(model, start))
        chosen = choose(reach, count, seed, by, angle_rad, share)
    except GeometryError as error:
        raise BadInputError(f"{profile.path}: {error}") from None
    _say(out, model, chosen, count)
    platform = profile.platform
    if out_file is not None:
        write_poses(out_file, chosen.positions, platform.controlled, model.positions)
        out.say(f"{out_file}: written")
    if png is not None:
        from cdpr_tools.robots.pose_choice import draw_poses  # noqa: PLC0415  # slow to load

        with os_error_as(BadInputError, str(png)):
            draw_poses(f"{profile.name}: {count} poses, {by}", reach, chosen, png)
        out.say(f"{png}: written")
    out.result(
        {
            "ok": True,
            "robot": profile.profile,
            "seed": seed,
            "choose": str(by),
            "directions": list(platform.controlled),
            "start": reach.start.tolist(),
            "poses": chosen.positions.tolist(),
            "shares": chosen.shares.tolist(),
            "drawn": chosen.drawn.drawn,
            "cut_by_contact": chosen.drawn.cut_by_contact,
            "cut_by_tensions": chosen.drawn.cut_by_tensions,
            "outside": chosen.drawn.outside,
            "clearance_m": chosen.clearance_m if math.isfinite(chosen.clearance_m) else None,
            "margin_N": chosen.margin_N,
            "predicted_exit_deviation_m": chosen.deviation_m,
        }
    )


def _angle_rad(model: PlatformModel, angle_deg: float | None) -> float | None:
    """Return the largest rotation of poses; raises BadInputError if it exceeds that of targets."""
    if angle_deg is None:
        return None
    most = math.degrees(model.angle_rad)
    if angle_deg > most + 1e-9:
        raise BadInputError(
            f"--angle {angle_deg:g}: allowed: up to {most:.4g} deg, workspace_angle_rad of the "
            "robot's file"
        )
    return math.radians(angle_deg)


def _start(model: PlatformModel, text: str | None) -> FloatArray | None:
    if text is None:
        return None
    position = np.array(model.home)
    position[: model.positions] = numbers("--from", text, "xyz"[: model.positions], "mm", 1e-3)
    return position


def _nearest(chosen: Chosen) -> str:
    if not math.isfinite(chosen.clearance_m):
        return "this robot has no possible contacts"
    return f"smallest distance {1e3 * chosen.clearance_m:.0f} mm"


def _say(out: Output, model: PlatformModel, chosen: Chosen, count: int) -> None:
    drawn, k = chosen.drawn, model.positions
    out.say(
        f"{count} poses of {drawn.drawn} drawn; {drawn.cut_by_contact} ways cut short by contact, "
        f"{drawn.cut_by_tensions} by tensions; {drawn.outside} left out, because they end outside "
        "the box of targets or on the stand",
        f"{_nearest(chosen)}; tensions keep at least {chosen.margin_N:.1f} N beyond the "
        "control's reserve",
    )
    if chosen.deviation_m is not None:
        out.say(
            f"a calibration with these poses would give exit points within "
            f"{1e3 * chosen.deviation_m:.1f} mm (one standard deviation of a coordinate)"
        )
    for position in chosen.positions[:_SHOWN]:
        place = " ".join(f"{1e3 * x:7.0f}" for x in position[:k])
        turned = " ".join(f"{math.degrees(x):6.1f}" for x in position[k:])
        out.say(f"  {place} mm" + (f"  {turned} deg" if turned else ""))
    if count > _SHOWN:
        out.say(f"  and {count - _SHOWN} more")
