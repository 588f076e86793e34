"""`cdpr calibrate measure`: a robot that a daemon runs, taken through poses and calibrated."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from cdpr_tools.client.client import Daemon
from cdpr_tools.commands.calibration.options import (
    AdoptOption,
    CameraUrlOption,
    DryRunOption,
    IdentifyOption,
    IntrinsicsOption,
    KnownMmOption,
    MarkersOption,
    OutDirOption,
    PosesOption,
    geometry_of,
    hand_eye_of,
)
from cdpr_tools.commands.daemon.with_daemon import with_daemon
from cdpr_tools.commands.options import HandEyeOption, SeedOption
from cdpr_tools.output import Output
from cdpr_tools.signals import HELD, stop_on_signals


@with_daemon
def measure(
    daemon: Daemon,
    out: Output,
    camera: CameraUrlOption = None,
    ask: Annotated[
        bool,
        typer.Option("--ask", help="Ask at each pose where the platform is measured to be."),
    ] = False,
    poses: PosesOption = None,
    intrinsics: IntrinsicsOption = None,
    markers: MarkersOption = None,
    hand_eye: HandEyeOption = None,
    seed: SeedOption = 1,
    identify: IdentifyOption = None,
    known_mm: KnownMmOption = None,
    out_dir: OutDirOption = None,
    dry_run: DryRunOption = False,
    adopt: AdoptOption = False,
) -> None:
    """Move the robot that a daemon runs through poses, read its cables, identify and take over.

    It stands at home on tight cables before, as after `cdpr tighten`, and is held at the last pose.
    Without --camera and --ask lengths and tensions alone are used. With poses in the folder, of
    `cdpr calibrate read` as well, it goes on behind them. Ctrl-C holds; status as of `run`.
    """
    with out.stage("choosing poses"):
        from cdpr_tools.calibrate.finish import finish, stop_criterion, with_hand_eye  # noqa: PLC0415
        from cdpr_tools.calibrate.measuring import daemon_pose, daemon_run  # noqa: PLC0415
        from cdpr_tools.calibrate.measuring.asked_points import AskedPoints, require_points_of  # noqa: PLC0415
        from cdpr_tools.calibrate.measuring.places import MOST_POSES, places_of, poses_wanted  # noqa: PLC0415
        from cdpr_tools.calibrate.measuring.run import DATA, POINTS, report_faults_only  # noqa: PLC0415  # slow to load
        from cdpr_tools.trials.directions import platform_of  # noqa: PLC0415  # slow to load

        robot, description = daemon_pose.robot_of(daemon)
        geometry, known = geometry_of(robot, identify, known_mm), hand_eye_of(hand_eye)
        count, listed = poses_wanted(robot, poses)
        folder = out_dir or Path("out") / f"calibrate-{robot.profile}"
        kept = daemon_pose.DaemonPoses(
            folder, daemon_pose.data_of(folder, robot, description["simulated"])
        )
        points = folder / POINTS
        require_points_of(len(kept.data.poses), points)
        # refused before poses are chosen, which takes a while, and before a file is made
        kept.require_home(robot, daemon_pose.held_place(daemon, robot))
        if ask or points.exists():
            out.note(f"measured positions: {points}")
        places, most = places_of(robot, count, listed, seed), count or MOST_POSES
    with (
        stop_on_signals(HELD) as stop,
        daemon_pose.image_taker(camera, intrinsics, markers, kept, out.note) as image,
        daemon_run.going_on(kept),
    ):
        kept.data = with_hand_eye(kept.data, known)
        operator = daemon_run.DaemonOperator(daemon, robot, image, stop)
        home_m = platform_of(robot).home_m
        asked = AskedPoints(out, points, len(home_m), operator.place) if ask else None
        criterion = stop_criterion(out, robot, points if ask else None, geometry)
        daemon_run.read_places(
            out, robot, operator, kept, places, most,
            criterion if count is None else report_faults_only(criterion),
            asked or (lambda _pose: None),
        )  # fmt: skip
    out.say("the platform is held at the last pose; `cdpr lower` takes it back onto its stand")
    finish(
        *(out, robot, kept.data, points if points.exists() else None, geometry),
        *(folder / DATA, folder, dry_run, adopt),
    )
