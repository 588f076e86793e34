"""The control interface: its routes, and how errors are answered."""

from __future__ import annotations

from collections.abc import Mapping
from http import HTTPStatus
from typing import Annotated, Any, Final

from fastapi import FastAPI, Header, Query, Request, Response
from fastapi.exceptions import RequestValidationError
from starlette.exceptions import HTTPException
from starlette.responses import JSONResponse

from cdpr_rt.service.http import models
from cdpr_rt.service.http.docs_page import docs_page
from cdpr_rt.service.http.metrics import MetricsCollector
from cdpr_rt.service.http.tickets import VALID_S
from cdpr_rt.service.http.websocket_routes import WebSocketRoutes
from cdpr_rt.service.lease import LeaseError
from cdpr_rt.service.link import CommandTooLongError, LoopBusyError, LoopGoneError, Reply
from cdpr_rt.service.path_planner import PlannerBusyError
from cdpr_rt.service.service import Service
from cdpr_rt.service.streams.setpoint_stream import StreamError

_ABOUT = """State, motion and figures of one robot's control loop.

Reading needs nothing but the connection. `enable`, `program` and `set` need the right to move:
`POST /control` gives it to one client at a time, the token goes into the header `X-Control-Token`.
`hold`, `disable` and `shutdown` are for everybody let in, and never refused for being one too many:
all who ask at once get one answer. What was asked for before them, and waits still, does not start.
"""
_STATUS: Final[dict[type[Exception], HTTPStatus]] = {
    LeaseError: HTTPStatus.CONFLICT,
    PlannerBusyError: HTTPStatus.CONFLICT,
    LoopGoneError: HTTPStatus.SERVICE_UNAVAILABLE,
    LoopBusyError: HTTPStatus.SERVICE_UNAVAILABLE,
    CommandTooLongError: HTTPStatus.REQUEST_ENTITY_TOO_LARGE,
    StreamError: HTTPStatus.NOT_FOUND,
}
_ERRORS: Final[dict[int | str, dict[str, Any]]] = {
    400: {"model": models.Error, "description": "The body is not JSON"},
    401: {"model": models.Error, "description": "The key is missing or wrong"},
    403: {"model": models.Error, "description": "Asked by a page of another host, or by its name"},
    408: {"model": models.Error, "description": "The body came too slowly"},
    413: {"model": models.Error, "description": "Too much to take"},
    422: {"model": models.Error, "description": "Not what this takes"},
    429: {"model": models.Error, "description": "Too many requests; never for a stop"},
}
_REFUSALS: Final[dict[int | str, dict[str, Any]]] = {
    409: {
        "model": models.Error,
        "description": "The loop, or the holder of the right to move, is in the way",
    },
    503: {"model": models.Error, "description": "No loop takes commands"},
}
_NO_STREAM: Final[dict[int | str, dict[str, Any]]] = {
    404: {"model": models.Error, "description": "No set-point stream is received"},
}
_TOKEN_MOST = 64
Token = Annotated[
    str | None,
    Header(
        alias="X-Control-Token",
        max_length=_TOKEN_MOST,
        description="What `POST /control` has given.",
    ),
]


class _LoopRefusedError(Exception):
    def __init__(self, reply: Reply) -> None:
        super().__init__(reply.text)
        self.reply = reply


def create_app(service: Service) -> FastAPI:
    """Return the application that serves `service`; it listens nowhere yet."""
    app = FastAPI(
        title="cdpr-rt",
        summary="The control loop of a cable robot",
        description=_ABOUT,
        docs_url=None,
        redoc_url=None,
        responses=_ERRORS,
    )
    _add_errors(app, service)
    _add_reading(app, service)
    _add_control(app, service)
    _add_open_commands(app, service)
    _add_motion(app, service)
    _add_path(app, service)
    WebSocketRoutes(service).add(app)
    _add_key(app)
    return app


def _add_key(app: FastAPI) -> None:
    """Describe the key: `AccessControl` asks for it before any request comes here."""
    described = app.openapi()  # kept by the application
    described["components"]["securitySchemes"] = {
        "key": {
            "type": "http",
            "scheme": "bearer",
            "description": "The shared key; on the Unix socket none is asked.",
        }
    }
    for path, operations in described["paths"].items():
        for operation in operations.values():
            operation["security"] = [] if path == "/status" else [{"key": []}]


def _add_errors(app: FastAPI, service: Service) -> None:
    async def known(_: Request, error: Exception) -> Response:
        state = service.link.state() if isinstance(error, LoopGoneError) else None
        return _error(_STATUS[type(error)], str(error), state=state)

    async def refused(_: Request, error: Exception) -> Response:
        assert isinstance(error, _LoopRefusedError)
        reply = error.reply
        why = {"refusal": reply.refusal} if reply.refusal else {}
        return _error(HTTPStatus.CONFLICT, reply.text or "refused", state=reply.state, **why)

    async def invalid(_: Request, error: Exception) -> Response:
        assert isinstance(error, RequestValidationError)
        first = error.errors()[0]
        if first["type"] == "json_invalid":
            return _error(HTTPStatus.BAD_REQUEST, f"the body is not JSON: {first['ctx']['error']}")
        where = ".".join(str(part) for part in first["loc"])
        return _error(HTTPStatus.UNPROCESSABLE_ENTITY, f"{where}: {first['msg']}")

    async def http(_: Request, error: Exception) -> Response:
        assert isinstance(error, HTTPException)
        return _error(error.status_code, str(error.detail), error.headers)

    for kind in _STATUS:
        app.add_exception_handler(kind, known)
    app.add_exception_handler(_LoopRefusedError, refused)
    app.add_exception_handler(RequestValidationError, invalid)
    app.add_exception_handler(HTTPException, http)


def _error(
    status: int, text: str, headers: Mapping[str, str] | None = None, /, **of_loop: Any
) -> Response:
    readable = text.encode("utf-8", "backslashreplace").decode()  # it may repeat what was sent
    body = {"error": readable, "state": None, **of_loop}
    return JSONResponse(body, status, headers)


def _add_reading(app: FastAPI, service: Service) -> None:
    metrics = MetricsCollector(service)

    @app.get("/status")
    async def status() -> models.Status:
        """Everything at a glance; needs no key, wherever it is asked from."""
        return models.Status.model_validate(service.status())

    @app.get("/description")
    async def description() -> dict[str, Any]:
        """The robot: axes, limits, programs; {} until the loop knows it."""
        return service.link.description()

    @app.get("/events")
    async def events(
        after: Annotated[
            int, Query(ge=0, le=2**53, description="Only those behind this number.")
        ] = 0,
        most: Annotated[int, Query(ge=1, le=512, description="Only the newest of them.")] = 100,
    ) -> models.Events:
        """What happened: states, reasons with their values, commands, who may move."""
        return models.Events.model_validate({"events": service.events.since(after, most)})

    @app.get("/metrics", response_class=Response, responses={200: {"content": {"text/plain": {}}}})
    async def prometheus() -> Response:
        """Figures for Prometheus."""
        return Response(metrics.text(), media_type="text/plain; version=0.0.4; charset=utf-8")

    @app.get("/docs", include_in_schema=False)
    @app.get("/", include_in_schema=False)
    async def docs() -> Response:
        return docs_page(app.openapi())

    service.background.append(metrics.watch)


def _add_control(app: FastAPI, service: Service) -> None:
    @app.get("/control")
    async def who() -> models.Control:
        """Who holds the right to move."""
        return models.Control.model_validate(service.control())

    @app.post("/control", responses=_REFUSALS)
    async def take(body: models.TakeControl) -> models.ControlTaken:
        """Take the right to move; it lapses `ttl_s` after the last request that shows the token."""
        token = service.lease.take(body.client, body.ttl_s)
        return models.ControlTaken(token=token, ttl_s=body.ttl_s)

    @app.put("/control", responses=_REFUSALS)
    async def renew(token: Token = None) -> models.Renewed:
        """Keep the right to move."""
        return models.Renewed(ttl_s=service.lease.renew(token).ttl_s)

    @app.delete("/control", responses=_REFUSALS)
    async def release(token: Token = None) -> models.Control:
        """Give the right to move back; what moves on somebody's behalf holds."""
        service.lease.release(token)
        return models.Control.model_validate(service.control())

    @app.post("/ticket")
    async def ticket() -> models.Ticket:
        """Get what opens one WebSocket without the key: `/live?ticket=T`, `/control?ticket=T`.

        For browsers, which send no `Authorization` with those.
        """
        return models.Ticket(ticket=service.tickets.issue(), valid_s=VALID_S)

    @app.post("/stream", responses={**_REFUSALS, **_NO_STREAM})
    async def stream(token: Token = None) -> models.StreamAccess:
        """Get a session of the set-point stream, in place of the one before.

        It lasts as long as the right to move; `session` and `key` sign the packets.
        """
        return models.StreamAccess.model_validate(service.issue_stream_session(token))


_OPEN_COMMANDS: Final = {
    "configure": "Boot the drives; no power.",
    "check": "Run the cycle without power and see whether all drives answer: inactive to ready.",
    "acknowledge": "Acknowledge a fault whose cause is gone; nothing gets power by it.",
    "hold": "Stop the motion and stay there, with power; for everybody who is let in.",
    "disable": "Stop the motion, then take the power off; for everybody who is let in.",
    "shutdown": "Stop the motion, take the power off, end the daemon; for everybody who is let in.",
}
"""Commands that need no right to move."""


def _add_open_commands(app: FastAPI, service: Service) -> None:
    def add(do: str, about: str) -> None:
        async def command(body: models.ClientRequest | None = None) -> models.Done:
            return _done(await service.command(do, body.client if body else "somebody"))

        app.post(f"/{do}", responses=_REFUSALS, name=do, description=about)(command)

    for do, about in _OPEN_COMMANDS.items():
        add(do, about)


def _add_motion(app: FastAPI, service: Service) -> None:
    async def ask(
        do: str, body: models.ClientRequest, token: str | None, request: Request, **fields: Any
    ) -> models.Done:
        reply = await service.command_with_right(
            do, body.client, token, request.is_disconnected, **fields
        )
        return _done(reply)

    @app.post("/enable", responses=_REFUSALS)
    async def enable(
        request: Request, body: models.Enable | None = None, token: Token = None
    ) -> models.Done:
        """Give the drives power and run a program."""
        body = body or models.Enable()
        fields = {"program": body.program, "wanted": body.wanted}
        return await ask("enable", body, token, request, **fields)

    @app.post("/program", responses=_REFUSALS)
    async def program(
        body: models.ProgramRequest, request: Request, token: Token = None
    ) -> models.Done:
        """Change over to a program, without a bump."""
        fields = {"program": body.program, "wanted": body.wanted}
        return await ask("program", body, token, request, **fields)

    @app.post("/set", responses=_REFUSALS)
    async def change(body: models.Set, request: Request, token: Token = None) -> models.Done:
        """Tell the running program what it is to do."""
        return await ask("set", body, token, request, wanted=body.wanted)

    @app.post("/lengths", responses=_REFUSALS)
    async def lengths(body: models.Set, request: Request, token: Token = None) -> models.Done:
        """Tell how long the cables are now: `cable_length_m`, one for each axis or null."""
        return await ask("lengths", body, token, request, wanted=body.wanted)


def _add_path(app: FastAPI, service: Service) -> None:
    @app.post("/path", responses=_REFUSALS)
    async def plan_path(body: models.PathFile) -> models.Planned:
        """Begin to plan a path for the robot; `GET /path` tells when it is planned."""
        return models.Planned.model_validate(service.planner.begin(body.model_dump()))

    @app.get("/path")
    async def planned_path() -> models.Planned:
        """The path that was planned last, or why the robot cannot follow it.

        The program `path` follows it by the name in `plan`.
        """
        return models.Planned.model_validate(service.planner.job)


def _done(reply: Reply) -> models.Done:
    if not reply.ok:
        raise _LoopRefusedError(reply)
    return models.Done(text=reply.text, state=reply.state)
