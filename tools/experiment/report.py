"""The experiment's tables as text, beside the thesis'."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, Final

from cdpr_tools.experiment import thesis

_NAMES: Final = {
    thesis.OPERATION: "round trip",
    thesis.SCALE: "scale",
    thesis.PLACE: "place",
}


def lines(result: dict[str, Any]) -> list[str]:
    """Return the result for people, line by line."""
    alone = result.get("operator_alone")
    return [
        *_errors(result["rows"]),
        "",
        *_times(result["rows"]),
        "",
        *([] if alone is None else [*_parts(result["rows"], alone), ""]),
        *_variance(result["variance_analysis"]),
        "",
        *_verdict(result),
    ]


def _head(row: dict[str, Any]) -> str:
    beside = row.get("thesis")
    other = beside["level"] if beside and beside["level"] != row["level"] else ""
    return f"{_NAMES[row['variable']]:11}{row['level']:>7} {f'({other})' if other else '':10}"


def _pair(values: list[float], digits: int = 2) -> str:
    return "".join(f"{value:8.{digits}f}" for value in values)


def _errors(rows: list[dict[str, Any]]) -> Iterator[str]:
    yield "Errors at the confirmed targets, mm (Tremblay, table 2.1)"
    yield f"{'':29}{'mean':>13}{'3 sigma':>17}{'thesis: mean':>19}{'3 sigma':>14}{'share':>16}"
    yield f"{'':29}" + f"{'x':>8}{'y':>8}" * 5
    for row in rows:
        text = _head(row) + _pair(row["mean_mm"]) + _pair(row["three_sigma_mm"])
        if beside := row.get("thesis"):
            text += _pair(beside["mean_mm"]) + _pair(beside["three_sigma_mm"])
            text += _pair(row["share_of_thesis"]) + ("" if row["reached"] else "  above half")
        yield text


def _times(rows: list[dict[str, Any]]) -> Iterator[str]:
    yield "Time for the path, s (Tremblay, table 2.2)"
    yield f"{'':29}{'mean':>8}{'sigma':>8}{'thesis':>8}{'sigma':>8}{'runs':>8}"
    for row in rows:
        beside = row.get("thesis", {"time_s": float("nan"), "time_sigma_s": float("nan")})
        yield (
            _head(row)
            + _pair([row["time_s"], row["time_sigma_s"]], 1)
            + _pair([beside["time_s"], beside["time_sigma_s"]], 1)
            + f"{row['runs']:8d}"
        )


def _parts(rows: list[dict[str, Any]], alone: list[dict[str, Any]]) -> Iterator[str]:
    yield "Where the errors come from, 3 sigma, mm: judged = what the operator was content with;"
    yield "hand, robot = what either moved from then on; beside it the same operator's total with a"
    yield "robot without error, and how far the platform was from its set-point"
    yield (
        f"{'':29}{'judged':>13}{'hand':>16}{'robot':>16}{'total':>16}{'perfect robot':>20}"
        f"{'off set-point':>16}"
    )
    for row, ideal in zip(rows, alone, strict=True):
        parts = row["parts_three_sigma_mm"]
        yield (
            _head(row)
            + "".join(_pair(parts[name]) for name in ("judged", "hand", "robot"))
            + _pair(row["three_sigma_mm"])
            + _pair(ideal["three_sigma_mm"])
            + _pair(row["following_three_sigma_mm"])
        )


def _variance(found: list[dict[str, Any]]) -> Iterator[str]:
    yield "Does the mean norm of the errors differ? (one-way analysis of variance, 95 %)"
    for one in found:
        groups, targets = one["degrees_of_freedom"]
        means = ", ".join(f"{value:.2f}" for value in one["mean_norm_mm"])
        yield (
            f"{_NAMES[one['variable']]:12}F({groups}, {targets}) = {one['F']:.2f}, "
            f"p = {one['p']:.2g}: {'yes' if one['differs'] else 'no'} "
            f"(thesis: {'yes' if one['differs_in_thesis'] else 'no'}); means {means} mm"
        )


def _verdict(result: dict[str, Any]) -> Iterator[str]:
    missed = [
        f"{_NAMES[row['variable']]} {row['level']}"
        for row in result["rows"]
        if not row.get("reached", True)
    ]
    if missed:
        yield f"3 sigma above half of the thesis': {', '.join(missed)}"
    else:
        yield "3 sigma at most half of the thesis' in every row"
