"""Render pages and files from Jinja2 templates, and format the numbers in them."""

from __future__ import annotations

import itertools
import json
import math
from functools import cache, partial
from typing import Any

from jinja2 import Environment, PackageLoader, StrictUndefined, select_autoescape
from markupsafe import Markup

from cdpr_tools.saving import OWN_MARK


def rendered(template: str, **facts: Any) -> str:
    """Return the text of a template from `templates` with these facts; HTML values are escaped."""
    number_of_figure = itertools.count(1).__next__
    return _environment().get_template(template).render(next_number=number_of_figure, **facts)


@cache
def _environment() -> Environment:
    environment = Environment(
        loader=PackageLoader("cdpr_tools"),
        undefined=StrictUndefined,
        autoescape=select_autoescape([".html.j2"]),
        keep_trailing_newline=True,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.filters |= {
        "number": number,
        "data": _data,
        "g": "{:g}".format,
        "quoted": partial(json.dumps, ensure_ascii=False),
    }
    environment.globals["own_mark"] = OWN_MARK.decode()
    return environment


def number(value: float | None, digits: int = 3) -> str:
    """Return a number with `digits` significant digits, without an exponent if still readable."""
    if value is None or not math.isfinite(value):
        return "–"
    if value == 0.0:
        return "0"
    places = digits - 1 - math.floor(math.log10(abs(value)))
    if places > digits + 3:
        return f"{value:.{digits - 1}e}"
    return f"{value:,.{max(places, 0)}f}".replace(",", "\u202f").replace("-", "−")


def _data(value: float | None) -> str:
    """Return a rounded number in an HTML element that also holds the full value."""
    if value is None:
        return number(value)
    return Markup(f'<data value="{float(value)!r}">{number(value)}</data>')
