"""The commissioning report: one HTML file with pictures, made from the files of a commissioning."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:  # those who want the pictures' style alone load neither
    from cdpr_profiles import Winch
    from cdpr_rt.procedures.commissioning.commission_files import Paths
    from cdpr_rt.procedures.commissioning.identified import Identified


def build(paths: Paths, winch: Winch, results: dict[str, Any], found: Identified) -> None:
    """Write the report and its figures; see `cdpr_tools.report.page.build`.

    The drawing library is loaded here and not before: while the motor turns, and while it is
    identified, its memory is better used.
    """
    from cdpr_tools.report import page  # noqa: PLC0415

    page.build(paths, winch, results, found)
