"""Program `hold`: brake and stay."""

from __future__ import annotations

from cdpr_rt.programs.axes.axis_program import AxisProgram


class HoldProgram(AxisProgram):
    """Brakes what moves, and holds the axes where they come to stand."""

    name = "hold"
