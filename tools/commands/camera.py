"""`cdpr camera`: images from a camera, and its intrinsics."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import cv2
import numpy as np
import typer
from numpy.typing import NDArray

from cdpr_drivers.camera.camera import Camera, open_camera
from cdpr_rt.calibration.marker_detection import Board, IntrinsicsFit, fit_intrinsics
from cdpr_rt.core.clock import PacedClock
from cdpr_tools.commands.options import JsonOption, OverwriteOption, PngOption, argument, option
from cdpr_tools.errors import WorkFailedError, os_error_as
from cdpr_tools.output import Output
from cdpr_tools.saving import require_free, save

app = typer.Typer(
    name="camera", help="Take images with a camera and calibrate its lens.", no_args_is_help=True
)


@app.command()
def grab(
    camera: Annotated[
        str,
        argument(
            "opencv:0, opencv:rtsp://..., genicam:PRODUCER.cti, sim:SOCKET, folder:DIR.",
            metavar="CAMERA",
        ),
    ],
    folder: Annotated[Path, option("Folder for the images.", "--out")],
    count: Annotated[int, option("Number of images.", min=1, max=10000)] = 1,
    interval_s: Annotated[
        float, option("Interval between images.", "--interval-s", min=0.0, max=3600.0)
    ] = 1.0,
    overwrite: OverwriteOption = False,
    as_json: JsonOption = False,
) -> None:
    """Write images from a camera into a folder, with the times at which they were taken."""
    out = Output(as_json)
    clock = PacedClock()
    with open_camera(camera, clock) as source:
        require_free("--out", folder, overwrite)
        folder.mkdir(parents=True, exist_ok=True)
        stamps = ["image,time_s,device_time_s"]
        with out.progress(f"{count} images", count * max(interval_s, 0.1)) as advance:
            for k in range(count):
                if k:
                    clock.sleep(interval_s)
                image = source.grab()
                if image is None:
                    break
                name = f"image-{k:04d}.png"
                if not cv2.imwrite(str(folder / name), image.pixels):
                    raise WorkFailedError(f"{folder / name}: cannot be written")
                device = "" if image.device_time_s is None else f"{image.device_time_s:.6f}"
                stamps.append(f"{name},{image.time_s:.6f},{device}")
                advance((k + 1) * max(interval_s, 0.1))
    save(folder / "times.csv", "\n".join(stamps) + "\n")
    out.say(f"{len(stamps) - 1} images and times.csv in {folder}")
    out.result({"ok": True, "folder": folder, "images": len(stamps) - 1})


@app.command()
def calibrate(
    camera: Annotated[str, argument("A folder of images, or a camera.", metavar="FOLDER|CAMERA")],
    target: Annotated[Path, option("File for the intrinsics.", "--out")],
    columns: Annotated[int, option("Columns of squares.", min=3, max=40)] = 9,
    rows: Annotated[int, option("Rows of squares.", min=3, max=40)] = 6,
    square_mm: Annotated[float, option("Side of a square.", min=2.0, max=1000.0)] = 28.0,
    marker_mm: Annotated[float, option("Side of a marker.", min=1.0, max=1000.0)] = 20.0,
    dictionary: Annotated[str, option("Set of the board's markers.")] = "5X5_100",
    count: Annotated[
        int, option("Images to take with a camera, one per second.", min=5, max=500)
    ] = 30,
    png: PngOption = None,
    overwrite: OverwriteOption = False,
    as_json: JsonOption = False,
) -> None:
    """Find a camera's intrinsics from images of a ChArUco board; report what is still missing."""
    out = Output(as_json)
    require_free("--out", target, overwrite)
    board = Board(columns, rows, square_mm / 1e3, marker_mm / 1e3, dictionary)
    clock = PacedClock()
    url = camera if ":" in camera else f"folder:{camera}"
    images: list[tuple[str, NDArray[np.uint8]]] = []
    with open_camera(url, clock) as source:
        live = not url.startswith("folder:")
        most = count if live else None
        _collect(source, images, most, out)
    with out.stage("fitting the lens"):
        fit = fit_intrinsics(images, board)
    _tell(out, fit)
    if png is not None:
        from cdpr_tools.calibrate.lens_picture import draw_lens  # noqa: PLC0415  # slow to load

        with os_error_as(WorkFailedError, f"{png}: cannot be written"):
            draw_lens(png, fit, images)
    save(target, fit.intrinsics.toml_text())
    out.say(f"intrinsics: {target}")
    one = fit.intrinsics
    out.result(
        {
            "ok": True,
            "out": target,
            "rms_px": one.rms_px,
            "focal_px": one.focal_px,
            "centre_px": one.centre_px,
            "distortion": one.distortion,
            "sigmas": one.sigmas,
            "used": len(fit.used),
            "left_out": fit.left_out,
            "missing": fit.missing,
        }
    )


def _collect(
    source: Camera,
    images: list[tuple[str, NDArray[np.uint8]]],
    most: int | None,
    out: Output,
) -> None:
    """Take one image per second until there are `most`; take all if it is None."""
    clock = PacedClock()
    with out.progress(f"images from {source.name}", float(most or 10)) as advance:
        while most is None or len(images) < most:
            image = source.grab()
            if image is None:
                return
            images.append((image.name, image.pixels))
            advance(float(len(images)))
            if most is not None:
                clock.sleep(1.0)


def _tell(out: Output, fit: IntrinsicsFit) -> None:
    one = fit.intrinsics
    sigmas = one.sigmas or (0.0,) * 9
    names = ("fx", "fy", "cx", "cy", "k1", "k2", "p1", "p2", "k3")
    out.say(f"{len(fit.used)} images, corners fit to {one.rms_px:.3f} px (rms); ± is 3 sigma")
    for name, value, sigma in zip(names, one.parameters, sigmas, strict=True):
        digits = 2 if name[0] in "fc" else 5
        unit = " px" if name[0] in "fc" else ""
        out.say(f"{name:4}{value:12.{digits}f} ± {3.0 * sigma:.{digits}f}{unit}")
    out.say(*(f"left out: {line}" for line in fit.left_out))
    out.say(*(f"missing: {line}" for line in fit.missing))
    if not fit.missing:
        out.say("no more images are needed")
