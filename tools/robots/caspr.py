"""Read the model of a cable robot for CASPR, as answers to the questions of `cdpr robot new`.

CASPR (https://github.com/darwinlau/CASPR) keeps a robot in two XML files: its bodies and its
cables. Lengths are in m, masses in kg, forces in N.
"""

from __future__ import annotations

from pathlib import Path
from typing import Final
from xml.etree import ElementTree

import numpy as np

from cdpr_profiles.bounded_input import read_bytes
from cdpr_rt.arrays import FloatArray
from cdpr_tools.errors import BadInputError
from cdpr_tools.robots.questions import KINDS, SEVEN_CABLES, Default, Question, kind_of

_PLANES: Final = {"XY": [0, 1], "XZ": [0, 2], "YZ": [1, 2]}
"""Coordinates of planar joints, such as PLANAR_XZ or P_XZ; the second one becomes the height.
Gravity acts along -z, so the plane of x and y is horizontal."""
_LEAST_SHARE: Final = 0.01
"""Ratio of least to greatest tension, for models whose cables may be slack."""
_MOST_BYTES: Final = 1 << 20


def read_caspr(bodies: Path, cables: Path, *, upright: bool = False) -> ModelAnswers:
    """Return answers from a model with one rigid body; the platform's origin is its centre of mass.

    A horizontal plane, in which no gravity acts, is only read as an `upright` one, with y upward.
    If there are several sets of cables, the model's default set is used. Targets are not turned.
    Raises BadInputError that names the file and the element.
    """
    links = _root(bodies, "bodies_system").findall("links/*")
    if len(links) != 1:
        raise BadInputError(f"{bodies}: links: {len(links)} bodies; allowed: one, the platform")
    link = links[0]
    joint = _found(link, "joint", bodies).get("type", "")
    plane = joint.removeprefix("PLANAR_").removeprefix("P_")
    kept = _PLANES.get(plane, [0, 1, 2])
    if len(kept) == 3 and not joint.startswith(("SPATIAL", "P_XYZ")):
        raise BadInputError(
            f"{bodies}: joint: type {joint!r}; allowed: PLANAR_XY, P_XY, or another plane, P_XYZ, "
            "SPATIAL_..."
        )
    if plane == "XY" and not upright:
        raise BadInputError(
            f"{bodies}: joint: type {joint!r}: the plane is horizontal, without gravity in it; "
            "tightening, lowering and the tensions rely on gravity along the last coordinate, and "
            "a robot's file has no key to turn it off; allowed: XZ, YZ, or --upright for a robot "
            "of this geometry that stands upright, with y upward"
        )
    room_m = _point(link, "parent/location", bodies)
    centre_m = _point(link, "physical/com_location", bodies)
    answers = {"mass_kg": f"{_number(link, 'physical/mass', bodies):g}"}
    exits, anchors, forces = [], [], []
    for cable in _default_set(cables):
        ends = cable.findall("attachments/attachment")
        if [_text(end, "link", cables) for end in ends] != ["0", "1"]:
            raise BadInputError(
                f"{cables}: {cable.get('name')}: attachments; allowed: two <attachment>, of "
                "link 0 and link 1; pulleys are not read"
            )
        on_frame, on_platform = (_point(end, "location", cables) for end in ends)
        of_origin = cable.get("attachment_reference") != "com"
        exits.append(on_frame - room_m)
        anchors.append(on_platform - centre_m * of_origin)
        keys = ("properties/force_min", "properties/force_max")
        forces.append([_number(cable, key, cables) for key in keys])
    if not forces:
        raise BadInputError(f"{cables}: cable_set: contains no cables; allowed: one or more")
    least_N, most_N = np.max(forces, axis=0)[0], np.min(forces, axis=0)[1]
    answers["tension_max_N"] = f"{most_N:g}"
    answers["tension_min_N"] = f"{max(least_N, _LEAST_SHARE * most_N):g}"
    for name, points in (("exit", exits), ("anchor", anchors)):
        for number, point in enumerate(points, start=1):
            answers[f"{name}_{number}_m"] = ", ".join(f"{x:.6g}" for x in point[kept])
    kind = kind_of_points(np.array(exits)[:, kept], np.array(anchors)[:, kept], cables)
    notes = []
    if plane == "XY":
        notes.append("gravity: the model's plane is horizontal; this robot stands upright")
    if kind_of(kind).controls_angles:
        answers["angle_deg"] = "0"
        notes.append("angle_deg: models have none; 0: no turned targets, otherwise --set angle_deg")
    return ModelAnswers({"kind": kind, **answers}, notes)


class ModelAnswers:
    """Answers the questions from a model, or with the default if the model has no valid value.

    `notes` says which values of the model were not used, and why.
    """

    def __init__(self, model: dict[str, str], notes: list[str]) -> None:
        self._model = model
        self.notes = notes

    def __call__(self, question: Question, default: Default, problem: str) -> str:
        """Return the answer to a question."""
        text = self._model.get(question.key)
        if question.key == "tension_max_N" and text and float(text) > float(default.text):
            problem = f"value {text}; these winches hold {default.text} N"
        if problem:
            self.notes.append(f"{question.key}: {problem}; instead: {default.text}")
        return default.text if text is None or problem else text


def kind_of_points(exits_m: FloatArray, anchors_m: FloatArray, file: Path) -> str:
    """Return the kind with this number of cables; raises BadInputError for other numbers."""
    count, size = exits_m.shape
    heights = exits_m[:, -1]
    is_point = not np.ptp(anchors_m, axis=0).any()
    if size == 2:
        kind = f"planar-{count}" if not is_point else "a point in a plane"
    elif is_point:
        kind = f"point-{count}"
    else:
        kind = f"{'suspended' if heights.min() > 0.5 * heights.max() else 'spatial'}-{count}"
    if kind not in KINDS | SEVEN_CABLES:
        allowed = ", ".join(KINDS | SEVEN_CABLES)
        raise BadInputError(
            f"{file}: {count} cables make it {kind}; allowed: {allowed}; for another number write "
            "the file with the nearest kind by `cdpr robot new` and add [[axes]]"
        )
    return kind


def _default_set(file: Path) -> list[ElementTree.Element]:
    root = _root(file, "cables")
    wanted = root.get("default_cable_set")
    for one in root.findall("cable_set"):
        if wanted in (None, one.get("id")):
            return list(one)
    raise BadInputError(f"{file}: cable_set: no set is called {wanted!r}, the default_cable_set")


def _root(file: Path, tag: str) -> ElementTree.Element:
    try:
        root = ElementTree.fromstring(read_bytes(file, _MOST_BYTES))
    except ElementTree.ParseError as error:
        raise BadInputError(f"{file}: is not XML: {error}") from None
    if root.tag != tag:
        raise BadInputError(f"{file}: begins with <{root.tag}>; allowed: <{tag}>")
    return root


def _found(parent: ElementTree.Element, path: str, file: Path) -> ElementTree.Element:
    found = parent.find(path)
    if found is None:
        where = parent.get("name", parent.tag)
        raise BadInputError(f"{file}: {where}: {path} is missing")
    return found


def _text(parent: ElementTree.Element, path: str, file: Path) -> str:
    return (_found(parent, path, file).text or "").strip()


def _number(parent: ElementTree.Element, path: str, file: Path) -> float:
    return float(_numbers(parent, path, file, 1)[0])


def _point(parent: ElementTree.Element, path: str, file: Path) -> FloatArray:
    return _numbers(parent, path, file, 3)


def _numbers(parent: ElementTree.Element, path: str, file: Path, count: int) -> FloatArray:
    text = _text(parent, path, file)
    try:
        numbers = np.array(text.split(), float)
    except ValueError:
        numbers = np.empty(0)
    if numbers.size != count or not np.isfinite(numbers).all():
        where = parent.get("name", parent.tag)
        raise BadInputError(f"{file}: {where}: {path}: {text!r}; allowed: {count} numbers")
    return numbers
