"""`cdpr calibrate read`: the pose at which a robot stands, for a robot that people move."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from cdpr_tools.client.client import Daemon
from cdpr_tools.commands.calibration.options import (
    CameraUrlOption,
    IntrinsicsOption,
    MarkersOption,
)
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
    camera: CameraUrlOption = None,
    intrinsics: IntrinsicsOption = None,
    markers: MarkersOption = None,
) -> None:
    """Read where a running robot's platform stands, for `cdpr calibrate fit`; moves nothing.

    The first pose is that at home, after `cdpr tighten`; `cdpr move` takes it to the others.
    Fifteen are the least. `cdpr calibrate measure` goes to them by itself.
    """
    from cdpr_tools.calibrate.measuring import daemon_pose  # noqa: PLC0415  # slow to load
    from cdpr_tools.calibrate.measuring.run import DATA, POINTS  # noqa: PLC0415  # slow to load
    from cdpr_tools.client.pose_reader import DaemonReader  # noqa: PLC0415  # slow to load

    robot, description = daemon_pose.robot_of(daemon)
    data = daemon_pose.data_of(out_dir, robot, description["simulated"])
    kept = daemon_pose.DaemonPoses(out_dir, data)
    with daemon_pose.image_taker(camera, intrinsics, markers, kept, out.note) as image:
        reader = DaemonReader(daemon, daemon_pose.cable_m_per_rad(robot), image)
        daemon_pose.read_into(reader, robot, kept)
    data = kept.data
    number = len(data.poses)
    out.say(*daemon_pose.lines(robot, data))
    points = f" --points {out_dir / POINTS}" if (out_dir / POINTS).exists() else ""
    out.say(f"{number} poses in {out_dir / DATA}")
    if number >= _ENOUGH:
        out.say(f"fit them: cdpr calibrate fit {robot.reference} --data {out_dir}{points}")
    reading = data.poses[-1]
    figures = {"pose": number, **reading.model_dump(include={"target", "length_m", "tension_N"})}
    out.result({"ok": True, **figures, "data": out_dir / DATA})
