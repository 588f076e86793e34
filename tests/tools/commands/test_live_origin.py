"""Web pages that may look at the live view are named as browsers name them."""

from __future__ import annotations

import pytest
from typer.testing import CliRunner

from cdpr_tools.commands.daemon.run import app
from cdpr_tools.errors import BadInputError


@pytest.mark.parametrize("typed", ["foo", "ftp://a.b", "https://a.b/view", "https://"])
def test_what_no_browser_sends_is_refused(typed: str) -> None:
    with pytest.raises(BadInputError, match=f"--live-origin {typed}: allowed: where a web page"):
        CliRunner().invoke(
            app,
            ["planar-3", "--bus", "simbus:", "--live-origin", typed],
            catch_exceptions=False,
        )
