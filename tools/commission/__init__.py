"""The commissioning report: one HTML file with pictures, made from the files of a commissioning."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from cdpr_profiles import Winch
    from cdpr_rt.procedures.commissioning_results import Identified, Paths


def build(paths: Paths, winch: Winch, results: dict[str, Any], found: Identified) -> None:
    """Write the report and its figures; see `cdpr_tools.commission.page.build`.

    The drawing library is imported only here, to save memory while the motor turns and while it
    is identified.
    """
    from cdpr_tools.commission import page  # noqa: PLC0415

    page.build(paths, winch, results, found)
