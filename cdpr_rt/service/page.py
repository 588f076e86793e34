"""The operator's page: its built files, served with a strict content-security policy."""

from __future__ import annotations

from importlib.resources import files
from typing import Final

from fastapi import FastAPI
from starlette.exceptions import HTTPException
from starlette.responses import Response

PAGE_PREFIX: Final = "/page/"
"""Path of all files that the page loads; they contain no information about the robot."""
_POLICY: Final = (
    "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' data:; "
    "connect-src 'self'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'"
)
_KINDS: Final = {
    ".html": "text/html; charset=utf-8",
    ".js": "text/javascript; charset=utf-8",
    ".css": "text/css; charset=utf-8",
    ".svg": "image/svg+xml",
    ".txt": "text/plain; charset=utf-8",
}
REPORTS_PREFIX: Final = "/reports/"
"""Path of all reports; each is below a name that only clients with the key can learn."""
REPORT_HEADERS: Final = {
    "content-security-policy": (
        "default-src 'none'; style-src 'unsafe-inline'; img-src 'self' data:; sandbox; "
        "base-uri 'none'; form-action 'none'; frame-ancestors 'none'"
    ),
}
"""A report runs no scripts, and belongs to no origin."""


def add_page(app: FastAPI) -> None:
    """Serve the page at `/`, and its other files below `PAGE_PREFIX`."""
    built = {one.name: one.read_bytes() for one in (files("cdpr_rt") / "page" / "built").iterdir()}

    def answer(name: str) -> Response:
        if name not in built:
            raise HTTPException(404)
        kind = _KINDS[name[name.rindex(".") :]]
        return Response(
            built[name], headers={"content-security-policy": _POLICY, "content-type": kind}
        )

    @app.get("/", include_in_schema=False)
    async def page() -> Response:
        return answer("index.html")

    @app.get(PAGE_PREFIX + "{name}", include_in_schema=False)
    async def part(name: str) -> Response:
        return answer(name)
