"""The report of a calibration: one HTML file with its pictures, which needs nothing beside it."""

from __future__ import annotations

import base64
from html import escape
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from cdpr_rt.calibration.outcome import Outcome
from cdpr_rt.calibration.readings.data import CalibrationData
from cdpr_rt.calibration.verification.verdict import parameter_table
from cdpr_tools.calibrate.report import picture as pictures
from cdpr_tools.calibrate.report.truth_comparison import TruthComparison
from cdpr_tools.report.save import save
from cdpr_tools.report.style import data_uri
from cdpr_tools.report.text import number, page, paragraph, picture, section, table

_IMAGE_WIDTH_px = 900
_ADD = (
    "What the calibration adds to the values of the robot's file: millimetres to coordinates of "
    "exit points and to lengths, per cent of the value to drums and elongation. The calibration's "
    "own file does so; nothing is to be typed into the robot's."
)


def write_report(
    path: Path,
    outcome: Outcome,
    data: CalibrationData,
    comparison: TruthComparison | None,
    next_steps: list[str],
    images: Path,
) -> None:
    """Write the page; raises WorkFailedError where it cannot be written."""
    save(path, _Report(outcome, data, comparison, next_steps, images).html())


class _Report:
    """One report while it is put together."""

    def __init__(
        self,
        outcome: Outcome,
        data: CalibrationData,
        comparison: TruthComparison | None,
        next_steps: list[str],
        images: Path,
    ) -> None:
        self._outcome, self._data, self._comparison = outcome, data, comparison
        self._next, self._images = next_steps, images
        self._pictures = 0

    def html(self) -> str:
        """Return the page."""
        outcome, data = self._outcome, self._data
        title = f"Calibration of {outcome.robot.name}"
        parts = [
            f"<h1>{escape(title)}</h1>",
            paragraph(
                f"{data.robot} · {len(data.poses)} poses, {len(data.left_out)} refused · "
                f"{'simulated' if data.simulated else 'measured'} {data.date} · in the frame of "
                f"{outcome.as_json()['frame']}",
                small=True,
            ),
            self._verdict(),
            section("How good it is", *self._how_good()),
            section("What was wrong", *self._wrong()),
            section("What is not known", *self._open()),
            section("What was identified", *self._identified()),
            *([section("Camera and markers", *self._camera())] if outcome.found.camera else []),
            section("What to do next", *map(paragraph, self._next)),
        ]
        return page(title, "\n".join(parts))

    def _picture(self, figure: Figure, what: str, caption: str) -> str:
        self._pictures += 1
        return picture(data_uri(figure), self._pictures, what, caption)

    def _verdict(self) -> str:
        outcome = self._outcome
        sigma = number(outcome.predicted_3_sigma_mm)
        good = [f"Positions are known to {sigma} mm (3 sigma, predicted)."]
        little = outcome.insignificance()
        lines = outcome.objections() or [*good, *([f"It is {little}."] if little else [])]
        head = "Good" if outcome.good else "Not good"
        body = "".join(f"<p>{escape(line)}</p>" for line in lines)
        kind = "" if outcome.good else " missed"
        return f'<div class="verdict{kind}"><b>{head}</b>{body}</div>'

    def _how_good(self) -> list[str]:
        outcome, comparison = self._outcome, self._comparison
        lines = []
        if comparison is not None:
            lines.append(_errors_table(comparison))
        lines.append(
            self._picture(
                pictures.map_figure(outcome, comparison),
                "Predicted errors over the workspace",
                "How well positions are known where the platform goes, at home's orientation, the "
                "worst along the axis that is not drawn."
                + (" Arrows: true errors of poses not used." if comparison is not None else ""),
            )
        )
        if comparison is not None:
            lines.append(
                self._picture(
                    pictures.held_out_figure(comparison),
                    "Errors of poses not used, before and after",
                    "Poses that the fit has not used, by lengths alone, beside what the scanner "
                    "measured; relative to the first pose.",
                )
            )
        return [*lines, *(paragraph(line, small=True) for line in outcome.proof())]

    def _wrong(self) -> list[str]:
        above = self._outcome.objections()
        faults = [paragraph(one.text) for one in self._outcome.faults if one.text not in above]
        return faults or [paragraph("Nothing contradicts the rest.")]

    def _open(self) -> list[str]:
        known = [paragraph(f"{one.what}.") for one in self._outcome.open_directions]
        return known or [paragraph("All that was to be identified is told by what was measured.")]

    def _identified(self) -> list[str]:
        figure = self._picture(
            pictures.found_figure(self._outcome),
            "Exit points moved, and lengths left over",
            "Above: where exit points are against the robot's file. Below: what lengths contradict "
            "each other by, a colour a cable, in the order of the poses.",
        )
        errors = {}
        if self._comparison is not None:
            errors = {row["name"]: row["error"] for row in self._comparison.parameters}
        rows = [
            [
                escape(str(row["name"])),
                f"{number(_value(row, 'change'))} {row['unit']}",
                f"± {number(_value(row, 'std'))}",
                *([number(errors.get(str(row["name"])))] if errors else []),
            ]
            for row in parameter_table(self._outcome.found)
        ]
        head = ["parameter", "change", "± 1 sigma", *(["true error"] if errors else [])]
        return [figure, table(head, rows, _ADD)]

    def _camera(self) -> list[str]:
        found = self._outcome.found
        camera = found.camera
        assert camera is not None  # see `html`
        lines = [
            paragraph(
                f"The camera is at {_listed_mm(camera.position_m)} mm on the platform, each to "
                f"{number(1e3 * float(found.camera_std[:3].max()), 2)} mm. The sheets are "
                f"{number(100.0 * camera.size_change, 2)} % larger than told."
            ),
            self._picture(
                pictures.markers_figure(found),
                "Markers from above",
                "Places of the markers, how well they are known against each other, and where the "
                "camera was.",
            ),
        ]
        if self._outcome.cover is not None:
            lines += [paragraph(f"{text}.") for text in self._outcome.cover.lines()]
        return [*lines, *self._image()]

    def _image(self) -> list[str]:
        """Return an image with what was found in it, where it was kept."""
        import cv2  # noqa: PLC0415  # an extra that data without images do not need

        shown = [len(one.image.markers) if one.image else 0 for one in self._data.poses]
        best = int(np.argmax(shown))
        pixels = cv2.imread(str(self._images / f"pose-{best + 1:04d}.png"))
        reading = self._data.poses[best].image
        if pixels is None or reading is None:
            return []
        for marker in reading.markers:
            corners = np.rint(np.array(marker.corners_px)).astype(np.int32)
            cv2.polylines(pixels, [corners], True, (26, 88, 209), 3)
        scale = _IMAGE_WIDTH_px / pixels.shape[1]
        small = cv2.resize(pixels, None, fx=scale, fy=scale, interpolation=cv2.INTER_AREA)
        _, coded = cv2.imencode(".jpg", small, [cv2.IMWRITE_JPEG_QUALITY, 80])
        source = "data:image/jpeg;base64," + base64.b64encode(coded.tobytes()).decode()
        self._pictures += 1
        caption = f"What the camera saw at pose {best + 1}, with the markers that were found."
        return [picture(source, self._pictures, "An image of the camera", caption)]


def _errors_table(comparison: TruthComparison) -> str:
    rows = []
    for name, errors in (
        ("scanner, relative to the first pose", comparison.scanner),
        ("the same by the robot's file", comparison.scanner_before),
        (f"scanner, in the frame of marker {comparison.marker}", comparison.in_marker_frame),
        ("what was true, relative to the first pose", comparison.truth),
    ):
        if errors is None:
            continue
        figures = errors.as_json()
        keys = ("position_error_mm", "orientation_error_deg")
        cells = [number(figures[f"{kind}_{key}"]) for key in keys for kind in ("mean", "worst")]
        rows.append([escape(name), *cells, errors.scale.text])
    head = ["against", "position, mean (mm)", "worst", "orientation, mean (deg)", "worst", "scale"]
    caption = (
        "Poses that the fit has not used, told by lengths alone. Scale: how many times as large "
        "distances between them are as those by lengths, ± 1 sigma."
    )
    return table(head, rows, caption)


def _value(row: dict[str, object], key: str) -> float:
    value = row[key]
    assert isinstance(value, float)  # as `parameter_table` makes it
    return value


def _listed_mm(position_m: np.ndarray) -> str:
    return ", ".join(number(1e3 * float(x), 4) for x in position_m)
