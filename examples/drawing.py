"""Draw an SVG file and a G-code file with the platform of planar-3.

You see the ways of the platform in a picture, by default drawing.png: a heart with a triangle from
drawing.svg, and a slot from drawing.nc. Of SVG it knows polylines and absolute M, L, C and Z.
"""

import re
import sys
from pathlib import Path
from xml.etree import ElementTree

import matplotlib as mpl

mpl.use("Agg")  # a file is written, no window opens

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.path import Path as Lines

import cdpr_rt as cdpr

HERE = Path(__file__).parent
CORNER_M, M_PER_UNIT = np.array([-0.15, 2.2]), 0.003  # where (0, 0) of the SVG file is, and scale


def points_m(svg: Path) -> np.ndarray:
    """Return the points (k, 2) of an SVG file in the room, with curves as short lines."""
    points, kinds, begin = list[np.ndarray](), list[np.uint8](), np.zeros((1, 2))
    for shape in ElementTree.parse(svg).iter():
        commands = shape.get("d") or f"M {shape.get('points', '')}"
        for letter, numbers in re.findall(r"([MLCZ])([^MLCZ]*)", commands):
            added = np.array(re.findall(r"-?[\d.]+", numbers), float).reshape(-1, 2)
            begin = added[:1] if letter == "M" else begin
            points += [*(begin if letter == "Z" else added)]
            kinds += [Lines.CURVE4 if letter == "C" else Lines.LINETO] * (len(points) - len(kinds))
    [lines] = Lines(points, [Lines.MOVETO, *kinds[1:]]).to_polygons(closed_only=False)
    return np.array(CORNER_M + M_PER_UNIT * np.array(lines, float) * [1.0, -1.0])


def main(picture: str) -> None:
    """Follow both files and draw the log."""
    rows = [f"{x},{y},0.5,0.01" for x, y in points_m(HERE / "drawing.svg")]
    points = Path(picture).with_suffix(".csv")
    points.write_text("\n".join(["x_m,y_m,speed_m_s,blend_m", *rows, ""]))
    with cdpr.simulate("planar-3") as robot:
        robot.enable()
        robot.tighten()
        for drawing in (points, HERE / "drawing.nc"):
            begun_s = robot.time_s
            robot.follow(drawing)
            log = robot.log("time_s", "pose")
            plt.plot(*log["pose"][log["time_s"] > begun_s, :2].T, label=drawing.name)
            print(f"{drawing.name}: {robot.time_s - begun_s:.1f} s of bus time")
    plt.gca().set(xlabel="x in m", ylabel="y in m", aspect="equal")
    plt.legend()
    plt.savefig(picture)


if __name__ == "__main__":
    main(*sys.argv[1:] or ["drawing.png"])
