"""HTML from values: escaped text, numbers with their units, tables, pictures, the page itself."""

from __future__ import annotations

import math
from collections.abc import Sequence
from html import escape

STYLE = """
:root { color-scheme: light; }
* { box-sizing: border-box; }
body { margin: 0; background: #fff; color: #1d2126;
  font: 1.03rem/1.55 Charter, "Bitstream Charter", "Sitka Text", Cambria, Georgia, serif; }
main { max-width: 50rem; margin: 0 auto; padding: 1.6rem 1.1rem 4rem; }
h1, h2, th, td, caption, figcaption, .small, nav, .verdict b {
  font-family: system-ui, -apple-system, "Segoe UI", Roboto, "Helvetica Neue", sans-serif; }
h1 { font-size: 1.65rem; line-height: 1.2; margin: 0 0 .3rem; letter-spacing: -.01em; }
h2 { font-size: 1.15rem; margin: 2.6rem 0 .5rem; padding-top: .7rem;
  border-top: 1px solid #d9dce0; }
p { margin: .55rem 0; }
.small { color: #59616b; font-size: .86rem; line-height: 1.45; }
.verdict { background: #f5f7f4; border-left: 4px solid #3b8f5a; padding: .5rem .9rem;
  margin: 1.1rem 0; }
.verdict.missed { background: #fbf5ee; border-color: #c98a1b; }
.scroll { overflow-x: auto; }
table { border-collapse: collapse; margin: .9rem 0; font-size: .9rem; line-height: 1.35;
  width: 100%; }
caption { text-align: left; color: #59616b; font-size: .86rem; padding-bottom: .35rem; }
th, td { text-align: left; vertical-align: top; padding: .38rem .6rem .38rem 0;
  border-bottom: 1px solid #e4e7ea; font-variant-numeric: tabular-nums; }
thead th { border-bottom: 1.5px solid #7d858e; font-weight: 600; vertical-align: bottom; }
tbody th { font-weight: 500; }
tbody .small { display: block; }
.together { white-space: nowrap; }
.good { color: #2a7145; } .bad { color: #a85d00; }
figure { margin: 1.2rem 0 1.5rem; }
figure img { display: block; width: 100%; height: auto; }
figure img { cursor: zoom-in; }
figure img:focus { position: fixed; inset: 0; z-index: 1; width: 100vw; height: 100vh;
  object-fit: contain; background: #fff; cursor: zoom-out; }
figcaption { font-size: .86rem; color: #414850; line-height: 1.45; margin-top: .35rem; }
@media (max-width: 40rem) {
  body { font-size: 1rem; } table { font-size: .84rem; } th, td { padding-right: .45rem; }
  figure .scroll img { width: 36rem; max-width: none; } }
@media print {
  body { font-size: 10pt; } main { max-width: none; padding: 0; }
  figure img { max-width: 14.5cm; margin: 0 auto; }
  figure, table, .verdict { break-inside: avoid; } h2 { break-after: avoid; } }
"""


def number(value: float | None, digits: int = 3) -> str:
    """Return a number to so many significant digits, without an exponent where one can read it."""
    if value is None or not math.isfinite(value):
        return "–"
    if value == 0.0:
        return "0"
    places = digits - 1 - math.floor(math.log10(abs(value)))
    if places > digits + 3:
        return f"{value:.{digits - 1}e}"
    return f"{value:,.{max(places, 0)}f}".replace(",", "\u202f").replace("-", "−")


def plain(value: float) -> str:
    """Return a round number as one would write it."""
    return f"{value:g}"


def data(value: float | None) -> str:
    """Return a number for people that carries its full value for programs."""
    if value is None:
        return number(value)
    return f'<data value="{float(value)!r}">{number(value)}</data>'


def paragraph(text: str, small: bool = False) -> str:
    """Return plain text as a paragraph."""
    return f'<p class="small">{escape(text)}</p>' if small else f"<p>{escape(text)}</p>"


def section(title: str, *parts: str) -> str:
    """Return parts under a heading."""
    return "\n".join([f"<section>\n<h2>{escape(title)}</h2>", *parts, "</section>"])


def table(head: Sequence[str], rows: Sequence[Sequence[str]], caption: str = "") -> str:
    """Return a table; the cells are HTML, head and caption plain text; no head where empty."""
    lines = [
        f'<tr><th scope="row">{row[0]}</th>' + "".join(f"<td>{c}</td>" for c in row[1:]) + "</tr>"
        for row in rows
    ]
    name = f"<caption>{escape(caption)}</caption>\n" if caption else ""
    cells = "".join(f'<th scope="col">{escape(cell)}</th>' for cell in head)
    top = f"<thead><tr>{cells}</tr></thead>\n" if head else ""
    body = "\n".join(lines)
    return f'<div class="scroll"><table>\n{name}{top}<tbody>\n{body}\n</tbody>\n</table></div>'


def picture(source: str, number_: int, what: str, caption: str) -> str:
    """Return a numbered picture; `what` is its text for those who do not see it.

    It fills the window as long as it has the focus: after a click, until another elsewhere.
    """
    return (
        f'<figure>\n<div class="scroll"><img tabindex="0" src="{source}" '
        f'alt="{escape(what)}"></div>\n'
        f"<figcaption><b>Figure {number_}.</b> {escape(caption)}</figcaption>\n</figure>"
    )


def page(title: str, body: str) -> str:
    """Return the whole page, which needs nothing beside itself."""
    return (
        '<!DOCTYPE html>\n<html lang="en">\n<head>\n<meta charset="utf-8">\n'
        '<meta name="viewport" content="width=device-width, initial-scale=1">\n'
        f"<title>{escape(title)}</title>\n<style>{STYLE}</style>\n</head>\n"
        f"<body>\n<main>\n{body}\n</main>\n</body>\n</html>\n"
    )
