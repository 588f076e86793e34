"""Routes of a robot's recordings: their list, the files themselves, tables and pictures of them."""

from __future__ import annotations

import asyncio
import os
from collections.abc import AsyncIterator
from pathlib import Path
from typing import Annotated, Any, Final

from fastapi import FastAPI, HTTPException, Query, Request, Response
from starlette.responses import FileResponse, StreamingResponse

from cdpr_profiles.bounded_input import open_regular
from cdpr_profiles.errors import brief
from cdpr_rt.core.cycle_row import AXES, FIELDS, POSES
from cdpr_rt.service import http_models as models
from cdpr_rt.service.access_control import note_progress
from cdpr_rt.service.recording_file import END
from cdpr_rt.service.recording_folder import READING_S
from cdpr_rt.service.rows import LABELS
from cdpr_rt.service.service import Service

_PIECE_BYTES: Final = 1 << 17
_MOST_POINTS: Final = 20_000
_CLIENT_GONE: Final = 499

_NOT_THERE: Final[dict[int | str, dict[str, Any]]] = {
    404: {"model": models.Error, "description": "No such recording"},
    409: {"model": models.Error, "description": "Too many recordings are being read"},
}
_Fields = Annotated[
    str, Query(max_length=1000, description="Fields separated by commas; all if empty.")
]
_From = Annotated[float, Query(ge=0, le=1e9, description="Begin, s after the first cycle.")]
_Until = Annotated[float, Query(gt=0, le=1e9, description="End, s after the first cycle.")]


def add_recordings(app: FastAPI, service: Service) -> None:
    """Add the routes of recordings, and the list of the quantities that they contain."""

    @app.get("/fields")
    async def fields() -> models.Fields:
        """The quantities of a cycle, for `/live` and for recordings."""
        return models.Fields.model_validate({"fields": [_described(name) for name in FIELDS]})

    @app.get("/recordings")
    async def listed() -> models.Recordings:
        """The recordings of this robot, newest first."""
        if service.recordings is None:
            return models.Recordings(recordings=[])
        found = await asyncio.to_thread(service.recordings.listed, _live_of(service)[0])
        return models.Recordings.model_validate({"recordings": found})

    @app.get("/recordings/{name}", response_class=Response, responses=_NOT_THERE)
    async def download(name: str) -> Response:
        """The file itself (MCAP); of the file that is being written, what is on the disk."""
        path = await _found(service, name)
        live, size = _live_of(service)
        if str(path) != live:
            return FileResponse(path, media_type="application/mcap", filename=path.name)
        return StreamingResponse(_begin_of(path, size), headers=_download(path.name, "mcap"))

    @app.get("/recordings/{name}/table.csv", response_class=Response, responses=_NOT_THERE)
    async def table(
        name: str, request: Request, fields: _Fields = "", from_s: _From = 0.0,
        until_s: _Until = 1e9,
    ) -> Response:  # fmt: skip
        """The cycles as CSV."""
        path = await _found(service, name)
        arguments = ("csv", str(path), _known(fields), f"{from_s}", f"{until_s}", "0")
        return await _read(service, request, _download(f"{path.stem}.csv", "csv"), *arguments)

    @app.get("/recordings/{name}/columns", responses=_NOT_THERE)
    async def columns(
        name: str, request: Request, fields: _Fields = "", from_s: _From = 0.0,
        until_s: _Until = 1e9,
        points: Annotated[int, Query(ge=2, le=_MOST_POINTS)] = 2000,
    ) -> models.Columns:  # fmt: skip
        """Curves for a plot: of each stretch of many cycles, the smallest and largest value."""
        path = await _found(service, name)
        arguments = ("columns", str(path), _known(fields), f"{from_s}", f"{until_s}", f"{points}")
        headers = {"content-type": "application/json"}
        return await _read(service, request, headers, *arguments)  # type: ignore[return-value]

    @app.get("/recordings/{name}/picture.png", response_class=Response, responses=_NOT_THERE)
    async def picture(name: str, request: Request) -> Response:
        """The picture that `cdpr log plot` draws."""
        path = await _found(service, name)
        arguments = ("picture", str(path), "", "0", "1e9", "0")
        return await _read(service, request, _download(f"{path.stem}.png", "png"), *arguments)


def _described(name: str) -> dict[str, Any]:
    per = "axis" if name in AXES else "pose" if name in POSES else "robot"
    return {"name": name, "meaning": FIELDS[name].meaning, "per": per, "labels": LABELS.get(name)}


def _live_of(service: Service) -> tuple[str | None, int]:
    """Return the file that is being written, and how much of it is complete."""
    figures = service.part_figures().get("recording", {})
    return (figures["file"], figures["file_bytes"]) if figures.get("recording") else (None, 0)


async def _found(service: Service, name: str) -> Path:
    folder = service.recordings
    path = None if folder is None else await asyncio.to_thread(folder.find, name)
    if path is None:
        raise HTTPException(404, f"{brief(name, 100)}: no recording of this robot has this name")
    return path


def _known(fields: str) -> str:
    for name in fields.split(","):
        if name and name not in FIELDS:
            raise HTTPException(422, f"fields: {brief(name, 100)} is not a field of a cycle")
    return fields


_KINDS: Final = {"mcap": "application/mcap", "csv": "text/csv; charset=utf-8", "png": "image/png"}


def _download(name: str, kind: str) -> dict[str, str]:
    return {
        "content-type": _KINDS[kind], "content-disposition": f'attachment; filename="{name}"'
    }  # fmt: skip


async def _begin_of(path: Path, size: int) -> AsyncIterator[bytes]:
    """Yield the complete part of a file that is being written, then an end of the file."""
    with os.fdopen(open_regular(path, links=False), "rb", buffering=0) as file:
        while size > 0:
            piece = await asyncio.to_thread(file.read, min(_PIECE_BYTES, size))
            if not piece:
                raise ConnectionError(f"{path}: has become shorter")
            size -= len(piece)
            yield piece
    yield END


async def _read(
    service: Service, request: Request, headers: dict[str, str], *arguments: str
) -> Response:
    assert service.recordings is not None  # the recording was found

    async def waiting() -> None:
        note_progress(request.scope)
        if await request.is_disconnected():
            raise ConnectionError("the client has gone")

    pieces = service.recordings.read(waiting, *arguments)
    try:
        first = await anext(pieces, b"")
    except ConnectionError:
        return Response(status_code=_CLIENT_GONE)
    except ValueError as error:
        raise HTTPException(422, str(error)) from None
    except TimeoutError:
        fix = "choose fewer fields or a shorter time"
        raise HTTPException(422, f"not read within {READING_S:g} s; {fix}") from None

    async def all_pieces() -> AsyncIterator[bytes]:
        yield first
        async for piece in pieces:
            yield piece

    return StreamingResponse(all_pieces(), headers=headers)
