"""Opens the operator's page in a browser."""

from __future__ import annotations

import webbrowser

from cdpr_tools.output import Output


def open_page(url: str, out: Output) -> None:
    """Open the page; if this machine has no browser, note that: the robot runs without one."""
    if not webbrowser.open(url):
        out.note("this machine offers no browser to open; enter the page's address in one yourself")
