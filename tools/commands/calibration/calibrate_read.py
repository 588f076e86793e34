"""`cdpr calibrate read`: the pose at which a robot stands, for a robot that people move."""

from __future__ import annotations

from contextlib import closing, nullcontext
from pathlib import Path
from typing import Annotated

import typer

from cdpr_tools.client.client import Daemon
from cdpr_tools.commands.daemon.with_daemon import with_daemon
from cdpr_tools.output import Output

_ENOUGH = 15


@with_daemon
def read(
    daemon: Daemon,
    out: Output,
    out_dir: Annotated[
        Path, typer.Option("--out", help="Folder of the poses; the first one begins it.")
    ],
    camera: Annotated[
        str | None,
        typer.Option(help="Take an image with it, such as opencv:0.", metavar="CAMERA"),
    ] = None,
    intrinsics: Annotated[
        Path | None, typer.Option(help="Of the camera, for the first pose.", metavar="FILE")
    ] = None,
    markers: Annotated[
        Path | None,
        typer.Option(help="Sizes of the sheets, for the first pose.", metavar="FILE"),
    ] = None,
) -> None:
    """Read where a running robot's platform stands, for `cdpr calibrate fit`; moves nothing.

    The first pose is that at home, after `cdpr tighten`; `cdpr move` takes it to the others.
    Fifteen are the least.
    """
    from cdpr_rt.core.clock import PacedClock  # noqa: PLC0415  # slow to load
    from cdpr_tools.calibrate.measuring import daemon_pose  # noqa: PLC0415  # slow to load
    from cdpr_tools.calibrate.measuring.run import DATA, IMAGES  # noqa: PLC0415  # slow to load

    robot, description = daemon_pose.robot_of(daemon)
    data = daemon_pose.data_of(out_dir, robot, description["simulated"])
    opened = None
    if camera is not None:
        from cdpr_tools.calibrate.measuring.pose_camera import (  # noqa: PLC0415  # needs an extra
            PoseCamera,
        )

        data = daemon_pose.with_camera(data, intrinsics, markers)
        assert data.camera is not None  # see `with_camera`
        opened = PoseCamera(
            camera, PacedClock(), data.camera.intrinsics, data.camera.sheets,
            out_dir / IMAGES, out.note,
        )  # fmt: skip
    with nullcontext() if opened is None else closing(opened):
        data = daemon_pose.read_into(daemon, robot, data, out_dir, opened)
    number = len(data.poses)
    out.say(*daemon_pose.lines(robot, data))
    if number >= _ENOUGH:
        out.say(f"fit them: cdpr calibrate fit {robot.reference} --data {out_dir}")
    reading = data.poses[-1]
    figures = {"pose": number, **reading.model_dump(include={"target", "length_m", "tension_N"})}
    out.result({"ok": True, **figures, "data": out_dir / DATA})
