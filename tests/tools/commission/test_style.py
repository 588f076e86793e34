"""Legends do not cover a picture."""

from __future__ import annotations

import pytest
from matplotlib.text import Text

from cdpr_tools.style import canvas, legend_above, legend_beside_title


@pytest.mark.parametrize(
    ("words", "same_line"), [("way", True), ("path of the platform, and its target", False)]
)
def test_a_title_moves_above_the_legend_if_there_is_no_room(words: str, same_line: bool) -> None:
    figure, (ax, _) = canvas(1, 2)
    for name in ("upper left", "lower"):
        ax.plot([0.0, 1.0], label=name)
    ax.set_title(words)
    legend_beside_title(ax)
    figure.draw_without_rendering()
    (title,) = ax.findobj(lambda one: isinstance(one, Text) and one.get_text() == words)
    legend = ax.get_legend()
    assert legend is not None
    written, box = title.get_window_extent(), legend.get_window_extent()
    assert not written.overlaps(box)
    assert bool(written.y0 < box.y1) is same_line
    assert written.y1 < figure.bbox.y1


@pytest.mark.parametrize("names", ["abcdefgh", "abcdef", "abc"])
def test_a_legend_is_ordered_row_by_row(names: str) -> None:
    figure, (ax,) = canvas(1, 1)
    for name in names:
        ax.plot([0.0, 1.0], label=name)
    legend_above(figure, ax, columns=4)
    figure.draw_without_rendering()
    (legend,) = figure.legends
    places = {text.get_text(): text.get_window_extent() for text in legend.get_texts()}
    assert sorted(places, key=lambda name: (-round(places[name].y0), places[name].x0)) == [*names]
