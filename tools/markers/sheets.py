"""Sheets of markers at their true size, as PDF: one to a page, with a bar to check the printer."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_pdf import PdfPages
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle

from cdpr_profiles.devices.camera import MarkerSheets
from cdpr_rt.calibration.markers.images.charuco import Board
from cdpr_tools.errors import BadInputError

PAGES_mm = {
    "A4": (210.0, 297.0),
    "A3": (297.0, 420.0),
    "A2": (420.0, 594.0),
    "A1": (594.0, 841.0),
    "A0": (841.0, 1189.0),
    "letter": (215.9, 279.4),
}
_MARGIN_mm = 5.0
"""That printers leave white."""
_TEXT_mm = 22.0
"""Under the marker, for scale bar and words."""
_BAR_mm = 100.0
_INCH_mm = 25.4


def write_marker_sheets(path: Path, sheets: MarkerSheets, ids: Sequence[int], page: str) -> None:
    """Write a PDF with a page for each id; raises BadInputError where one does not fit, OSError."""
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


def write_board_sheet(path: Path, board: Board, page: str) -> None:
    """Write a PDF with a ChArUco board; raises BadInputError where it does not fit, OSError."""
    figure = board_page(board, page)
    with PdfPages(path) as pdf:
        pdf.savefig(figure)


def board_page(board: Board, page: str) -> Figure:
    """Return the page of a ChArUco board; raises BadInputError where it does not fit."""
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
    """Raise BadInputError unless a marker fits with a white square's width around it."""
    width, height = PAGES_mm[page]
    needed = size_mm * (squares + 2) / squares
    most = min(width - 2.0 * _MARGIN_mm, height - 2.0 * _MARGIN_mm - _TEXT_mm)
    if needed > most:
        raise BadInputError(
            f"--size-mm {size_mm:g}: with the white around it {needed:.0f} mm; on {page} there are "
            f"{most:.0f} mm, so {most * squares / (squares + 2):.0f} mm is the largest"
        )


def _page(page: str, turned: bool = False) -> tuple[Figure, Axes]:
    """Return a page of true size, whose axes count mm from its lower left."""
    width, height = PAGES_mm[page][:: -1 if turned else 1]
    figure = Figure(figsize=(width / _INCH_mm, height / _INCH_mm))
    ax = figure.add_axes((0.0, 0.0, 1.0, 1.0))
    ax.set(xlim=(0.0, width), ylim=(0.0, height))
    ax.axis("off")
    return figure, ax


def _filled(x: float, y: float, width: float, height: float, colour: str = "black") -> Rectangle:
    """Return a rectangle that is exactly so large: not moved to some pixel grid."""
    return Rectangle(
        (x, y), width, height, facecolor=colour, edgecolor="none", linewidth=0.0, snap=False
    )


def _draw_bits(ax: Axes, bits: Any, left: float, low: float, size_mm: float) -> None:
    """Draw a marker: a black square, and white ones on it."""
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
        "this bar is 100 mm long: measure it; print without scaling (100 %)",
        ha="center",
        fontsize=8,
    )
