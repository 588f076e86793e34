"""`cdpr markers`: sheets to print, and the map of those that a camera has seen."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import numpy as np
import typer
from numpy.typing import NDArray

from cdpr_drivers.camera.camera import Image
from cdpr_drivers.camera.folder_camera import FolderCamera
from cdpr_profiles.devices.camera import CameraIntrinsics, MarkerSheets
from cdpr_profiles.errors import ProfileError
from cdpr_profiles.reading.reader import validated
from cdpr_rt.arrays import FloatArray
from cdpr_rt.calibration.markers.coverage import Coverage
from cdpr_rt.calibration.markers.geometry.rotations import logarithms
from cdpr_rt.calibration.markers.images.charuco import Board
from cdpr_rt.calibration.markers.images.detection import MarkerDetector
from cdpr_rt.calibration.markers.images.dictionaries import dictionary_shown
from cdpr_rt.calibration.markers.map_fit import MapFit, fit_map, verdict
from cdpr_rt.calibration.markers.sighting import Sighting
from cdpr_rt.core.clock import PacedClock
from cdpr_tools.commands.options import JsonOption, OverwriteOption, PngOption, written_as
from cdpr_tools.errors import BadInputError, WorkFailedError, os_error_as, raised_as
from cdpr_tools.markers.picture import draw_map
from cdpr_tools.markers.sheets import PAGES_mm, write_board_sheet, write_marker_sheets
from cdpr_tools.output import Output
from cdpr_tools.report.save import save

app = typer.Typer(
    name="markers", help="Printed markers: sheets, and maps of them.", no_args_is_help=True
)

_SizeOption = Annotated[
    float | None,
    typer.Option("--size-mm", min=1.0, max=10000.0, help="Width of the black square, outer edges."),
]
_DictionaryOption = Annotated[str, typer.Option(help="Set of markers, as OpenCV calls it.")]
_SheetsOption = Annotated[
    Path | None,
    typer.Option("--markers", help="File with sizes, and places that are known, of markers."),
]
_PageOption = Annotated[str, typer.Option(help=f"Paper: {', '.join(PAGES_mm)}.")]
_PdfOption = Annotated[Path, typer.Option("--out", help="PDF file.", callback=written_as(".pdf"))]
_MIRROR_CHECKS = 12


@app.command("print")
def print_command(
    ids: Annotated[str, typer.Argument(help="Marker numbers, as 0-39 or 0,3,7.", metavar="IDS")],
    size_mm: _SizeOption = None,
    dictionary: _DictionaryOption = "4X4_100",
    sheets: _SheetsOption = None,
    page: _PageOption = "A4",
    target: _PdfOption = Path("markers.pdf"),
    overwrite: OverwriteOption = False,
    as_json: JsonOption = False,
) -> None:
    """Write a PDF with a marker of true size on each page, and a bar to check the printer with."""
    out = Output(as_json)
    described = _sheets(sheets, size_mm, dictionary)
    marker_ids = _ids(ids)
    _require_page(page)
    _require_free(target, overwrite)
    with os_error_as(BadInputError, f"--out {target}"):
        write_marker_sheets(target, described, marker_ids, page)
    out.say(
        f"{target}: {len(marker_ids)} sheets on {page}. Print at 100 %, without fitting to the "
        "page; then measure the bar and a black square."
    )
    out.result({"ok": True, "out": target, "ids": marker_ids, "page": page})


@app.command()
def board(
    page: _PageOption = "A4",
    columns: Annotated[int, typer.Option(min=3, max=40, help="Columns of squares.")] = 9,
    rows: Annotated[int, typer.Option(min=3, max=40, help="Rows of squares.")] = 6,
    square_mm: Annotated[float, typer.Option(min=2.0, max=1000.0, help="Side of a square.")] = 28.0,
    marker_mm: Annotated[float, typer.Option(min=1.0, max=1000.0, help="Side of a marker.")] = 20.0,
    dictionary: _DictionaryOption = "5X5_100",
    target: _PdfOption = Path("board.pdf"),
    overwrite: OverwriteOption = False,
    as_json: JsonOption = False,
) -> None:
    """Write a PDF with a ChArUco board, from images of which a camera's intrinsics are found."""
    out = Output(as_json)
    _require_page(page)
    _require_free(target, overwrite)
    made = Board(columns, rows, square_mm / 1e3, marker_mm / 1e3, dictionary)
    with os_error_as(BadInputError, f"--out {target}"):
        write_board_sheet(target, made, page)
    out.say(f"{target}: a board of {columns} x {rows} squares of {square_mm:g} mm on {page}")
    out.result({"ok": True, "out": target})


@app.command("map")
def map_command(
    folder: Annotated[Path, typer.Argument(help="Images, in the order of their names.")],
    camera: Annotated[
        Path | None,
        typer.Option(help="Intrinsics of the camera; camera.toml in FOLDER where left out."),
    ] = None,
    size_mm: _SizeOption = None,
    dictionary: _DictionaryOption = "4X4_100",
    sheets: _SheetsOption = None,
    reference: Annotated[
        int | None, typer.Option(help="Marker in whose frame the map is; one is chosen otherwise.")
    ] = None,
    target: Annotated[
        Path | None, typer.Option("--out", help="Write the map here, as a file for --markers.")
    ] = None,
    png: PngOption = None,
    as_json: JsonOption = False,
) -> None:
    """Make the map of markers from images of them, and say how good it is and what is wrong."""
    out = Output(as_json)
    if not folder.is_dir() or not any(folder.iterdir()):
        raise BadInputError(f"{folder}: allowed: a folder with images")
    described = _sheets(sheets, size_mm, dictionary)
    intrinsics = CameraIntrinsics.load_file(camera or folder / "camera.toml")
    sightings = _sightings(folder, described, intrinsics, out)
    problems = [f"{one.name}: {one.problem}" for one in sightings if one.problem is not None]
    out.say(*problems)
    if len(problems) == len(sightings):
        raise WorkFailedError(f"{folder}: none of {len(sightings)} images can be used")
    out.note(f"fitting {sum(len(one.corners_px) for one in sightings)} sightings")
    fit = fit_map(sightings, intrinsics, described, reference)
    _say(out, fit)
    if target is not None:
        save(target, _map_text(fit, described))
        out.say(f"map: {target}")
    if png is not None:
        with os_error_as(BadInputError, f"--png {png}"):
            draw_map(fit, png)
        out.say(f"picture: {png}")
    out.result(_as_dict(fit, problems))
    if fit.faults:
        raise typer.Exit(WorkFailedError.exit_status)


def _sightings(
    folder: Path, sheets: MarkerSheets, intrinsics: CameraIntrinsics, out: Output
) -> list[Sighting]:
    """Return what each image of a folder shows."""
    detector = MarkerDetector(sheets.dictionary)
    found: list[Sighting] = []
    with FolderCamera(str(folder), PacedClock()) as source:
        count = len(source.files)
        every = max(1, count // _MIRROR_CHECKS)
        with out.progress(f"{count} images", float(count)) as advance:
            while (image := source.grab()) is not None:
                _require_size(image, intrinsics)
                mirrors = len(found) % every == 0
                found.append(detector.detect(image.pixels, image.name, mirrors=mirrors))
                advance(float(len(found)))
                last = image.pixels
    if not any(one.corners_px or one.mirrored for one in found):
        _require_set(last, sheets.dictionary)
    return found


def _require_set(pixels: NDArray[np.uint8], dictionary: str) -> None:
    """Raise BadInputError where an image shows markers of another set."""
    shown = dictionary_shown(pixels)
    if shown is not None and shown != dictionary:
        raise BadInputError(
            f"--dictionary {dictionary}: no image shows a marker of it; they show some of {shown}"
        )


def _require_size(image: Image, intrinsics: CameraIntrinsics) -> None:
    height, width = image.pixels.shape
    if (width, height) != (intrinsics.width_px, intrinsics.height_px):
        raise BadInputError(
            f"{image.name} has {width} x {height} pixels, the intrinsics are for "
            f"{intrinsics.width_px} x {intrinsics.height_px}: another camera, or another resolution"
        )


def _sheets(path: Path | None, size_mm: float | None, dictionary: str) -> MarkerSheets:
    if path is not None:
        if size_mm is not None:
            raise BadInputError("--size-mm and --markers: the file has the sizes; give one of them")
        return MarkerSheets.load_file(path)
    if size_mm is None:
        raise BadInputError("--size-mm is missing: the width of the black square, as measured")
    table = {"dictionary": dictionary, "size_m": size_mm / 1e3}
    with raised_as(BadInputError, ProfileError):
        return validated(Path("--dictionary"), table, MarkerSheets)


def _ids(text: str) -> list[int]:
    ids: list[int] = []
    try:
        for part in text.split(","):
            first, dash, last = part.partition("-")
            ids += range(int(first), int(last if dash else first) + 1)
    except ValueError:
        raise BadInputError(f"IDS {text!r}; allowed: such as 0-39 or 0,3,7") from None
    if not 0 < len(ids) <= 1024 or len(set(ids)) < len(ids):
        raise BadInputError(f"IDS {text!r}; allowed: 1 to 1024 ids, each once")
    return ids


def _require_page(page: str) -> None:
    if page not in PAGES_mm:
        raise BadInputError(f"--page {page!r}; allowed: {', '.join(PAGES_mm)}")


def _require_free(target: Path, overwrite: bool) -> None:
    if target.exists() and not overwrite:
        raise BadInputError(f"--out {target}: is there already; --overwrite replaces it")


def _say(out: Output, fit: MapFit) -> None:
    cover: Coverage = fit.coverage
    share = (
        "" if cover.share_seen is None else f", {100.0 * cover.share_seen:.0f} % of those placed"
    )
    out.say(f"{cover.images} images show {len(cover.ids)} markers{share}")
    for label, lines in (("wrong", fit.faults), ("left out", fit.warnings), ("note", fit.notes)):
        out.say(*(f"{label}: {line}" for line in lines))
    out.say(f"verdict: {verdict(fit)}")


def _map_text(fit: MapFit, sheets: MarkerSheets) -> str:
    map_ = fit.map
    where = "of the layout" if sheets.known else f"of marker {fit.fixed[0]}"
    lines = [
        f"# Marker map in the frame {where}; {verdict(fit)}.",
        f'dictionary = "{sheets.dictionary}"',
        f"size_m = {sheets.size_m!r}",
    ]
    for one in sheets.sizes:
        lines += ["", "[[sizes]]", f"ids = {list(one.ids)}", f"size_m = {one.size_m!r}"]
    for k in np.flatnonzero(map_.placed).tolist():
        lines += [
            *("", "[[known]]", f"id = {map_.ids[k]}"),
            f"position_m = {np.round(map_.position_m[k], 6).tolist()}",
            f"rotation_deg = {_turn_deg(fit, k).round(4).tolist()}",
        ]
    return "\n".join(lines) + "\n"


def _turn_deg(fit: MapFit, number: int) -> FloatArray:
    return np.asarray(np.degrees(logarithms(fit.map.rotation[number])[0]))


def _as_dict(fit: MapFit, problems: list[str]) -> dict[str, Any]:
    map_, cover = fit.map, fit.coverage
    sigma = fit.bundle.marker_sigma_m
    return {
        "ok": not fit.faults,
        "verdict": verdict(fit),
        "faults": fit.faults,
        "warnings": fit.warnings,
        "notes": fit.notes,
        "image_problems": problems,
        "images": cover.images,
        "islands": cover.islands,
        "share_seen": cover.share_seen,
        "rms_px": fit.bundle.rms_px,
        "sigma_px": fit.bundle.sigma_px,
        "held": fit.fixed,
        "scale_to_known": None if fit.known is None else fit.known.scale,
        "known_rms_mm": None if fit.known is None else 1e3 * fit.known.rms_m,
        "focal_change": fit.lens.focal_change,
        "markers": [
            {
                "id": map_.ids[k],
                "position_m": map_.position_m[k],
                "rotation_deg": _turn_deg(fit, k),
                "sigma_mm": 1e3 * sigma[k],
            }
            for k in np.flatnonzero(map_.placed).tolist()
        ],
    }
