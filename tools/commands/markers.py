"""`cdpr markers`: print marker sheets, and make a map of the markers that a camera has seen."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Any

import cv2
import numpy as np
import typer
from matplotlib.axes import Axes
from matplotlib.backends.backend_pdf import PdfPages
from matplotlib.collections import PolyCollection
from matplotlib.figure import Figure
from matplotlib.layout_engine import ConstrainedLayoutEngine
from matplotlib.patches import Rectangle
from matplotlib.patheffects import withStroke
from numpy.typing import NDArray

from cdpr_drivers.camera.camera import Image
from cdpr_drivers.camera.folder_camera import FolderCamera
from cdpr_profiles.camera import CameraIntrinsics, MarkerSheets
from cdpr_profiles.errors import ProfileError
from cdpr_profiles.reader import validated
from cdpr_rt.arrays import FloatArray
from cdpr_rt.calibration.camera_geometry import logarithms
from cdpr_rt.calibration.marker_detection import Board, MarkerDetector, dictionary_shown
from cdpr_rt.calibration.marker_map import Coverage, Sighting
from cdpr_rt.calibration.marker_map_fit import MapFit, fit_map, verdict
from cdpr_rt.core.clock import PacedClock
from cdpr_tools.commands import options
from cdpr_tools.commands.options import argument, option
from cdpr_tools.errors import BadInputError, WorkFailedError, os_error_as, raised_as
from cdpr_tools.output import Output
from cdpr_tools.saving import require_free, save
from cdpr_tools.style import LINES, colour_bar, legend_beside_title, save_figure

# Marker sheets at true size, as PDF: one marker per page, with a bar to check the printer.

PAGES_mm = {
    "A4": (210.0, 297.0),
    "A3": (297.0, 420.0),
    "A2": (420.0, 594.0),
    "A1": (594.0, 841.0),
    "A0": (841.0, 1189.0),
    "letter": (215.9, 279.4),
}
_MARGIN_mm = 5.0
"""Margin that printers leave white."""
_TEXT_mm = 22.0
"""Space under the marker for scale bar and text."""
_BAR_mm = 100.0
_INCH_mm = 25.4


def write_marker_sheets(path: Path, sheets: MarkerSheets, ids: Sequence[int], page: str) -> None:
    """Write a PDF with a page for each id; raises OSError, or BadInputError if one does not fit."""
    dictionary: Any = _dictionary(sheets.dictionary)
    count = len(dictionary.bytesList)
    squares = dictionary.markerSize + 2
    for marker in ids:
        if not 0 <= marker < count:
            raise BadInputError(
                f"marker {marker}; allowed: 0 to {count - 1} with dictionary {sheets.dictionary}"
            )
        _require_fit(1e3 * sheets.size_of(marker), squares, page)
    with PdfPages(path) as pdf:
        for marker in ids:
            pdf.savefig(marker_page(sheets, marker, page))


def marker_page(sheets: MarkerSheets, marker: int, page: str) -> Figure:
    """Return the page of one marker."""
    dictionary = _dictionary(sheets.dictionary)
    squares = dictionary.markerSize + 2
    size_mm = 1e3 * sheets.size_of(marker)
    bits = cv2.aruco.generateImageMarker(dictionary, marker, squares)
    figure, ax = _page(page)
    width, height = PAGES_mm[page]
    left, low = 0.5 * (width - size_mm), 0.5 * (height - size_mm + _TEXT_mm)
    under = low - size_mm / squares
    _draw_bits(ax, bits, left, low, size_mm)
    _draw_bar(ax, width, under - 4.0)
    ax.text(
        width / 2.0,
        under - 15.0,
        f"{sheets.dictionary}  id {marker}  {size_mm:g} mm over the black square   "
        "\N{UPWARDS ARROW} top",
        ha="center",
        fontsize=10,
    )
    return figure


def board_page(board: Board, page: str) -> Figure:
    """Return the page of a ChArUco board; raises BadInputError if it does not fit."""
    width, height = PAGES_mm[page]
    wide, high = 1e3 * board.square_m * board.columns, 1e3 * board.square_m * board.rows
    turned = wide > high and height > width
    if turned:
        width, height = height, width
    if wide > width - 2.0 * _MARGIN_mm or high > height - 2.0 * _MARGIN_mm - _TEXT_mm:
        raise BadInputError(
            f"a board of {wide:g} x {high:g} mm does not fit on {page} ({width:g} x {height:g} mm)"
        )
    made = board.made()
    dictionary = _dictionary(board.dictionary)
    figure, ax = _page(page, turned)
    left, top = 0.5 * (width - wide), 0.5 * (height + high) + _TEXT_mm / 2.0
    square = 1e3 * board.square_m
    corners = np.array(made.getObjPoints())[:, 0, :2] * 1e3
    ids = made.getIds().ravel()
    taken = {(int(x // square), int(y // square)) for x, y in corners}
    for i in range(board.rows):
        for j in range(board.columns):
            if (j, i) not in taken:
                ax.add_patch(_filled(left + j * square, top - (i + 1) * square, square, square))
    size = 1e3 * board.marker_m
    for marker, (x, y) in zip(ids, corners, strict=True):
        bits = cv2.aruco.generateImageMarker(dictionary, int(marker), dictionary.markerSize + 2)
        _draw_bits(ax, bits, left + x, top - y - size, size)
    _draw_bar(ax, width, top - high - 6.0)
    ax.text(
        width / 2.0,
        top - high - 17.0,
        f"ChArUco {board.columns} x {board.rows}, squares {square:g} mm, markers {size:g} mm, "
        f"{board.dictionary}; glue it on something flat",
        ha="center",
        fontsize=9,
    )
    return figure


def _dictionary(name: str) -> Any:
    return cv2.aruco.getPredefinedDictionary(getattr(cv2.aruco, f"DICT_{name}"))


def _require_fit(size_mm: float, squares: int, page: str) -> None:
    """Raise BadInputError unless a marker fits with a white margin of one square around it."""
    width, height = PAGES_mm[page]
    needed = size_mm * (squares + 2) / squares
    most = min(width - 2.0 * _MARGIN_mm, height - 2.0 * _MARGIN_mm - _TEXT_mm)
    if needed > most:
        raise BadInputError(
            f"--size-mm {size_mm:g}: needs {needed:.0f} mm with its white edge; {page} has "
            f"{most:.0f} mm, so {most * squares / (squares + 2):.0f} mm is the largest size"
        )


def _page(page: str, turned: bool = False) -> tuple[Figure, Axes]:
    """Return a page of true size, with axes in mm from its lower left corner."""
    width, height = PAGES_mm[page][:: -1 if turned else 1]
    figure = Figure(figsize=(width / _INCH_mm, height / _INCH_mm))
    ax = figure.add_axes((0.0, 0.0, 1.0, 1.0))
    ax.set(xlim=(0.0, width), ylim=(0.0, height))
    ax.axis("off")
    return figure, ax


def _filled(x: float, y: float, width: float, height: float, colour: str = "black") -> Rectangle:
    """Return a rectangle of exact size, not snapped to a pixel grid."""
    return Rectangle(
        (x, y), width, height, facecolor=colour, edgecolor="none", linewidth=0.0, snap=False
    )


def _draw_bits(ax: Axes, bits: Any, left: float, low: float, size_mm: float) -> None:
    """Draw a marker: a black square with white squares on it."""
    n = len(bits)
    one = size_mm / n
    ax.add_patch(_filled(left, low, size_mm, size_mm))
    for i, j in np.argwhere(bits):
        ax.add_patch(_filled(left + j * one, low + (n - 1 - i) * one, one, one, "white"))


def _draw_bar(ax: Axes, width: float, y: float) -> None:
    """Draw a scale bar whose parts of 10 mm alternate."""
    start = 0.5 * (width - _BAR_mm)
    for k in range(10):
        face = "black" if k % 2 == 0 else "white"
        ax.add_patch(
            Rectangle(
                (start + 10.0 * k, y),
                10.0,
                2.0,
                facecolor=face,
                edgecolor="black",
                lw=0.3,
                snap=False,
            )
        )
    ax.text(
        start + _BAR_mm / 2.0,
        y - 5.0,
        "this bar should measure 100 mm; print without scaling (100 %)",
        ha="center",
        fontsize=8,
    )


# The picture of a marker map: poses of markers and camera, and the accuracy of each position.

_REFERENCE = "#d1581a"


def draw_map(fit: MapFit, path: Path) -> None:
    """Write the picture as PNG.

    The upper part shows the map from the front of its reference marker. The lower part shows the
    accuracy of each position over its distance from that marker, along the marker's plane and
    across it, like figures 3.20 and 3.21 of the thesis.
    """
    map_ = fit.map
    figure = Figure(figsize=(7.4, 8.6), layout=ConstrainedLayoutEngine(w_pad=0.15))
    top, low = figure.subplots(2, 1, height_ratios=(2.2, 1.0))
    placed = map_.placed
    known_mm = 3e3 * fit.bundle.marker_sigma_m
    corners = map_.corners_m()[placed][..., :2]
    shades = PolyCollection(list(corners), cmap="YlOrBr", edgecolors="#222222", linewidths=0.6)
    shades.set_array(np.linalg.norm(known_mm[placed], axis=1))
    top.add_collection(shades)
    for marker, position in zip(np.array(map_.ids)[placed], map_.position_m[placed], strict=True):
        colour = _REFERENCE if marker in fit.fixed else "#222222"
        name = top.annotate(
            str(marker), position[:2], ha="center", va="center", fontsize=7, color=colour
        )
        name.set_path_effects([withStroke(linewidth=2.0, foreground="white")])
    cameras = map_.camera_position_m[map_.located]
    top.plot(*cameras[:, :2].T, "+", ms=5, color=LINES, label="camera")
    top.set(xlabel="x (m)", ylabel="y (m)", aspect="equal", title="marker map")
    top.autoscale_view()
    legend_beside_title(top)
    colour_bar(figure, shades, top, "uncertainty of the place (mm, 3 sigma)")
    start = map_.ids.index(fit.fixed[0])
    away = np.linalg.norm(map_.position_m - map_.position_m[start], axis=1)
    turn = map_.rotation[start]
    variance = np.einsum("ia,mij,ja->ma", turn, fit.bundle.marker_covariance_m2, turn)[placed]
    along = 3e3 * np.sqrt(variance[:, :2].sum(axis=1))
    low.plot(away[placed], along, "o", ms=4, label="along the plane of the reference marker")
    low.plot(away[placed], 3e3 * np.sqrt(variance[:, 2]), "s", ms=4, label="across it")
    low.set(xlabel=f"distance from marker {fit.fixed[0]} (m)", ylabel="uncertainty (mm, 3 sigma)")
    low.set_ylim(bottom=0.0)
    legend_beside_title(low)
    save_figure(figure, path)


app = typer.Typer(
    name="markers", help="Print camera markers and measure a map of them.", no_args_is_help=True
)

_SizeOption = Annotated[
    float | None,
    option("Width of the black square, outer edges.", "--size-mm", min=1.0, max=10000.0),
]
_DictionaryOption = Annotated[str, option("Dictionary of markers, by its name in OpenCV.")]
_SheetsOption = Annotated[
    Path | None, option("File with sizes and known places of markers.", "--markers")
]
_PageOption = Annotated[str, option(f"Paper: {', '.join(PAGES_mm)}.")]
_PdfOption = Annotated[
    Path, option("PDF file.", "--out", callback=options.written_as(".pdf", mark=b""))
]
_MIRROR_CHECKS = 12


@app.command("print")
def print_command(
    ids: Annotated[str, argument("Marker ids, such as 0-39 or 0,3,7.", metavar="IDS")],
    size_mm: _SizeOption = None,
    dictionary: _DictionaryOption = "4X4_100",
    sheets: _SheetsOption = None,
    page: _PageOption = "A4",
    target: _PdfOption = Path("markers.pdf"),
    overwrite: options.OverwriteOption = False,
    as_json: options.JsonOption = False,
) -> None:
    """Write a PDF with a marker of true size on each page, and a bar to check the printer."""
    out = Output(as_json)
    described = _sheets(sheets, size_mm, dictionary)
    marker_ids = _ids(ids)
    _require_page(page)
    require_free("--out", target, overwrite)
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
    columns: Annotated[int, option("Columns of squares.", min=3, max=40)] = 9,
    rows: Annotated[int, option("Rows of squares.", min=3, max=40)] = 6,
    square_mm: Annotated[float, option("Side of a square.", min=2.0, max=1000.0)] = 28.0,
    marker_mm: Annotated[float, option("Side of a marker.", min=1.0, max=1000.0)] = 20.0,
    dictionary: _DictionaryOption = "5X5_100",
    target: _PdfOption = Path("board.pdf"),
    overwrite: options.OverwriteOption = False,
    as_json: options.JsonOption = False,
) -> None:
    """Write a PDF with a ChArUco board, for finding a camera's intrinsics."""
    out = Output(as_json)
    _require_page(page)
    require_free("--out", target, overwrite)
    made = Board(columns, rows, square_mm / 1e3, marker_mm / 1e3, dictionary)
    with os_error_as(BadInputError, f"--out {target}"):
        figure = board_page(made, page)
        with PdfPages(target) as pdf:
            pdf.savefig(figure)
    out.say(f"{target}: a board of {columns} x {rows} squares of {square_mm:g} mm on {page}")
    out.result({"ok": True, "out": target})


@app.command("map")
def map_command(
    folder: Annotated[Path, argument("Images, in the order of their names.")],
    camera: Annotated[
        Path | None, option("Intrinsics of the camera; default: camera.toml in FOLDER.")
    ] = None,
    size_mm: _SizeOption = None,
    dictionary: _DictionaryOption = "4X4_100",
    sheets: _SheetsOption = None,
    reference: Annotated[
        int | None,
        option("Marker whose frame is that of the map; chosen automatically by default."),
    ] = None,
    target: Annotated[
        Path | None, option("Write the map here, as a file for --markers.", "--out")
    ] = None,
    png: options.PngOption = None,
    as_json: options.JsonOption = False,
) -> None:
    """Make a map of markers from images of them, and report its accuracy and any problems."""
    out = Output(as_json)
    if not folder.is_dir() or not any(folder.iterdir()):
        raise BadInputError(f"{folder}: is not a folder with images")
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
        draw_map(fit, png)
        out.say(f"picture: {png}")
    out.result(_as_dict(fit, problems))
    if fit.faults:
        raise typer.Exit(WorkFailedError.exit_status)


def _sightings(
    folder: Path, sheets: MarkerSheets, intrinsics: CameraIntrinsics, out: Output
) -> list[Sighting]:
    """Return the markers seen in each image of a folder."""
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
    """Raise BadInputError if an image shows markers of another dictionary."""
    shown = dictionary_shown(pixels)
    if shown is not None and shown != dictionary:
        raise BadInputError(
            f"--dictionary {dictionary}: no image shows a marker of this dictionary; they "
            f"show markers of {shown}"
        )


def _require_size(image: Image, intrinsics: CameraIntrinsics) -> None:
    height, width = image.pixels.shape
    if (width, height) != (intrinsics.width_px, intrinsics.height_px):
        raise BadInputError(
            f"{image.name} has {width} x {height} pixels, but the intrinsics are for "
            f"{intrinsics.width_px} x {intrinsics.height_px}: is it another camera or "
            "resolution?"
        )


def _sheets(path: Path | None, size_mm: float | None, dictionary: str) -> MarkerSheets:
    if path is not None:
        if size_mm is not None:
            raise BadInputError(
                "--size-mm and --markers: give only one of them, because the file also contains "
                "sizes"
            )
        return MarkerSheets.load_file(path)
    if size_mm is None:
        raise BadInputError("--size-mm is missing: give the measured width of the black square")
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


def _say(out: Output, fit: MapFit) -> None:
    cover: Coverage = fit.coverage
    share = (
        ""
        if cover.share_seen is None
        else f", {100.0 * cover.share_seen:.0f} % of the markers laid out"
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
