"""`cdpr sim camera` and `cdpr sim photos`: a simulated camera, with or without a robot."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import Annotated

import cv2
import numpy as np
import typer
from numpy.typing import NDArray

from cdpr_profiles.camera import CameraIntrinsics
from cdpr_sim_bus.camera.camera_server import CameraServer
from cdpr_sim_bus.camera.sim_camera import Box, SimCamera, random_poses
from cdpr_sim_bus.physics_board import PhysicsBoard
from cdpr_sim_bus.robot.camera_plant import CameraPlant
from cdpr_tools.calibrate.pose_camera import images_of_board, ordered_sheets
from cdpr_tools.commands import options
from cdpr_tools.commands.options import argument, option
from cdpr_tools.errors import BadInputError
from cdpr_tools.number_options import numbers
from cdpr_tools.output import Output
from cdpr_tools.saving import require_free, save

_PlantOption = Annotated[
    Path | None, option("Camera's plant file: the truth about lens, mount, light and markers.")
]

app = typer.Typer()


@app.command()
def camera(
    socket: Annotated[Path, argument("Unix socket to create.", metavar="SOCKET")],
    board: Annotated[Path, option("Physics board of the robot that carries the camera.")],
    plant: _PlantOption = None,
    exit_with_stdin: options.ExitWithStdinOption = False,
) -> None:
    """Run a camera on a simulated platform until Ctrl-C; other commands use it as sim:SOCKET.

    Type `dark`, `defocus 6` or `unplug` to break it, and `mend` to repair it.
    """
    made = SimCamera(CameraPlant.load_file(plant))
    with PhysicsBoard.attach(board) as shared:
        platform = shared.platform
        if platform.state() is None:
            raise BadInputError(f"--board {board}: its axes carry no platform")
        lens = made.plant.lens
        details = {"width_px": lens.width_px, "height_px": lens.height_px}
        CameraServer(made, platform, socket).serve(exit_with_stdin, details)


@app.command()
def photos(
    folder: Annotated[Path, argument("New folder for the images.", metavar="FOLDER")],
    plant: _PlantOption = None,
    count: Annotated[int, option("Number of images.", min=1, max=2000)] = 40,
    seed: options.SeedOption = 1,
    low: Annotated[
        str, option("Lowest position of the platform, m.", metavar='"X Y Z"')
    ] = "-0.5 -0.4 1.4",
    high: Annotated[
        str, option("Highest position of the platform, m.", metavar='"X Y Z"')
    ] = "0.2 0.6 1.75",
    tilt_deg: Annotated[float, option("Most rotation.", min=0.0, max=80.0)] = 15.0,
    board: Annotated[
        bool, option("Show a ChArUco board from near, for its lens.", "--board")
    ] = False,
    overwrite: Annotated[
        bool, option("Replace files that are already in FOLDER.", "--overwrite")
    ] = False,
    as_json: options.JsonOption = False,
) -> None:
    """Write images of a simulated camera from random poses, and its intrinsics.

    The true intrinsics are written to camera.toml beside the images, and the sheets as they were
    ordered from the printer to markers.toml.
    """
    out = Output(as_json)
    truth = CameraPlant.load_file(plant)
    (x_low, y_low, z_low), (x, y, z) = (
        numbers(option, text, "xyz", "m", 1.0)
        for option, text in (("--low", low), ("--high", high))
    )
    box = Box((x_low, y_low, z_low), (x, y, z), tilt_deg)
    require_free("FOLDER", folder, overwrite)
    folder.mkdir(parents=True, exist_ok=True)
    lens = truth.lens
    if board:
        images: Iterable[NDArray[np.uint8]] = (one for _, one in images_of_board(out, truth, count))
    else:
        made = SimCamera(truth)
        images = (made.grab(state) for state in random_poses(box, count, seed))
    with out.progress(f"writing {count} images", float(count)) as advance:
        for k, pixels in enumerate(images):
            path = folder / f"image-{k:04d}.png"
            if not cv2.imwrite(str(path), pixels):
                raise BadInputError(f"{path}: cannot be written")
            advance(k + 1.0)
    intrinsics = CameraIntrinsics.model_validate(lens, from_attributes=True)
    save(folder / "camera.toml", intrinsics.toml_text())
    save(folder / "markers.toml", ordered_sheets(truth).toml_text())
    out.say(f"{count} images, camera.toml and markers.toml in {folder}")
    out.result({"ok": True, "folder": folder, "images": count})
