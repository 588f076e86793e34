"""The control interface: its routes, and the answers to errors."""

from __future__ import annotations

import asyncio
import math
import re
from collections.abc import Iterator, Mapping
from html import escape
from http import HTTPStatus
from typing import Annotated, Any, Final

import numpy as np
from fastapi import Depends, FastAPI, Header, Query, Request, Response
from fastapi.exceptions import RequestValidationError
from prometheus_client import CollectorRegistry, generate_latest
from prometheus_client.core import (
    CounterMetricFamily,
    GaugeMetricFamily,
    HistogramMetricFamily,
    Metric,
)
from prometheus_client.registry import Collector
from starlette.exceptions import HTTPException
from starlette.responses import FileResponse, HTMLResponse, JSONResponse

from cdpr_rt.arrays import FloatArray
from cdpr_rt.core.cycle_row import AXIS_FIELDS, SCALAR_FIELDS, CycleField, Row
from cdpr_rt.core.shared_block import RowReader
from cdpr_rt.core.states import LoopState
from cdpr_rt.service import http_models as models
from cdpr_rt.service.access_control import STOPS_BEFORE, VALID_S
from cdpr_rt.service.lease import LeaseError
from cdpr_rt.service.link import (
    DEAD,
    STARTING,
    CommandTooLongError,
    LoopBusyError,
    LoopGoneError,
    Reply,
)
from cdpr_rt.service.page import REPORT_HEADERS, REPORTS_PREFIX, add_page
from cdpr_rt.service.procedure_runner import ProcedureError
from cdpr_rt.service.recording_folder import RecordingsBusyError
from cdpr_rt.service.recording_routes import add_recordings
from cdpr_rt.service.rows import newest_row
from cdpr_rt.service.service import (
    DescribingError,
    DriveTextsError,
    InjectionError,
    PlannerBusyError,
    Service,
)
from cdpr_rt.service.setpoint_stream import StreamError
from cdpr_rt.service.websocket_routes import WebSocketRoutes

# Figures for Prometheus.

_READ_S = 0.2
_MOST_ROWS = 2000
_BOUNDS_S: Final = np.array(
    [2e-5, 5e-5, 1e-4, 2e-4, 3e-4, 4e-4, 5e-4, 7e-4, 1e-3, 2e-3, 5e-3, 1e-2, 0.1]
)
_SCALARS: Final = tuple(field for field in SCALAR_FIELDS if field.metric)
_TIMES: Final = tuple(field for field in _SCALARS if field.is_wall_time)
_NUMBERS: Final = tuple(field for field in _SCALARS if field.kind == "<f8" and not field.wall)
_COUNTS: Final = tuple(field for field in _SCALARS if field.kind != "<f8")
_AXES: Final = tuple(field for field in AXIS_FIELDS if field.metric)


class _Histogram:
    """Counts of a duration by size, over all cycles."""

    def __init__(self) -> None:
        self.counts = np.zeros(_BOUNDS_S.size + 1, np.int64)
        self.sum_s = 0.0

    def add(self, values_s: FloatArray) -> None:
        finite = values_s[np.isfinite(values_s)]
        places = np.searchsorted(_BOUNDS_S, finite)
        self.counts += np.bincount(places, minlength=self.counts.size)
        self.sum_s += float(finite.sum())

    def buckets(self) -> list[tuple[str, float]]:
        names = [*(f"{bound:g}" for bound in _BOUNDS_S), "+Inf"]
        return list(zip(names, np.cumsum(self.counts).astype(float).tolist(), strict=True))


class MetricsCollector(Collector):
    """Collects durations while `watch` runs, and all other figures on request."""

    def __init__(self, service: Service) -> None:
        self._service = service
        self._rows = RowReader(service.block)
        self._times = {field.name: _Histogram() for field in _TIMES}
        self._registry = CollectorRegistry()
        self._registry.register(self)

    def text(self) -> bytes:
        """Return everything in Prometheus' text format."""
        return generate_latest(self._registry)

    async def watch(self) -> None:
        """Count durations of all cycles, until cancelled."""
        while True:
            rows = self._rows.read(_MOST_ROWS)
            for name, histogram in self._times.items():
                histogram.add(rows[name])
            await asyncio.sleep(0.0 if rows.size == _MOST_ROWS else _READ_S)

    def describe(self) -> list[Metric]:
        """Return nothing: the figures are only known when they are collected."""
        return []

    def collect(self) -> Iterator[Metric]:
        """Return all present figures."""
        yield from self._of_loop()
        for field in _TIMES:
            histogram = self._times[field.name]
            name = f"cdpr_cycle_{field.metric}_seconds"
            yield HistogramMetricFamily(name, _about(field), histogram.buckets(), histogram.sum_s)
        row = newest_row(self._service.block)
        if row is not None:
            yield from self._of_row(row)
        yield self._of_parts()

    def _of_loop(self) -> Iterator[Metric]:
        service = self._service
        state = GaugeMetricFamily("cdpr_state", "1 for the state the loop is in", labels=["state"])
        now = service.link.state()
        for label in (*(one.label for one in LoopState), STARTING, DEAD):
            state.add_metric([label], float(label == now))
        yield state
        yield GaugeMetricFamily(
            "cdpr_loop_silent_seconds",
            "Time since the last cycle of the loop",
            service.link.silent_s(),
        )
        held = float(service.lease.holder() is not None)
        yield GaugeMetricFamily(
            "cdpr_control_held", "1 while a client holds the right to move", held
        )
        yield CounterMetricFamily(
            "cdpr_rows_not_seen", "Cycles missing in the histograms", self._rows.lost
        )

    def _of_row(self, row: Row) -> Iterator[Metric]:
        for field in _COUNTS:
            yield CounterMetricFamily(f"cdpr_{field.metric}", _about(field), int(row[field.name]))
        for field in _NUMBERS:
            if math.isfinite(value := float(row[field.name])):
                yield GaugeMetricFamily(f"cdpr_{field.metric}", _about(field), value)
        axes = self._service.link.description().get("axes") or []
        names = [str(axis.get("name", number)) for number, axis in enumerate(axes)]
        for field in _AXES:
            family = GaugeMetricFamily(f"cdpr_axis_{field.metric}", _about(field), labels=["axis"])
            for name, value in zip(names, row[field.name].tolist(), strict=False):
                if math.isfinite(value):
                    family.add_metric([name], value)
            yield family

    def _of_parts(self) -> Metric:
        family = GaugeMetricFamily(
            "cdpr_part_figure", "Figures of the service's parts", labels=["part", "figure"]
        )
        for part, figures in self._service.part_figures().items():
            for name, value in _numbers(figures):
                family.add_metric([part, name], value)
        return family


def _about(field: CycleField) -> str:
    """Return a field's description; no metric is null; unknown values are omitted."""
    about = field.meaning.partition("; null")[0]
    return about[0].upper() + about[1:]


def _numbers(figures: dict[str, Any], before: str = "") -> Iterator[tuple[str, float]]:
    for name, value in figures.items():
        if isinstance(value, bool | int | float):
            yield before + name, float(value)
        elif isinstance(value, dict):
            yield from _numbers(value, f"{before}{name}_")


# The interface's description as a page without scripts and external content.

_POLICY: Final = "default-src 'none'; style-src 'unsafe-inline'; frame-ancestors 'none'"
_STYLE: Final = """
body { font: 16px/1.5 system-ui, sans-serif; max-width: 60rem; margin: 2rem auto; padding: 0 1rem; }
h2 { margin: 2rem 0 .3rem; font-size: 1.1rem; } code, h2 { font-family: ui-monospace, monospace; }
table { border-collapse: collapse; } td, th { padding: .1rem .8rem .1rem 0; text-align: left;
vertical-align: top; } .method { color: #205493; } .about { white-space: pre-line; }
"""


def docs_page(openapi: dict[str, Any]) -> HTMLResponse:
    """Return the page for an OpenAPI description."""
    about = openapi["info"]
    parts = [
        f"<h1>{escape(about['title'])}</h1>",
        f'<p class="about">{_marked(about["description"])}</p>',
        '<p>For programs: <a href="/openapi.json">openapi.json</a>. WebSockets: <code>/live</code> '
        "and <code>/control</code>.</p>",
    ]
    schemas = openapi["components"]["schemas"]
    for path, methods in openapi["paths"].items():
        for method, operation in methods.items():
            parts += _operation(path, method, operation, schemas)
    page = (
        '<!doctype html><html lang="en"><meta charset="utf-8">'
        f"<title>{escape(about['title'])}</title><style>{_STYLE}</style>{''.join(parts)}</html>"
    )
    return HTMLResponse(page, headers={"content-security-policy": _POLICY})


def _operation(
    path: str, method: str, operation: dict[str, Any], schemas: dict[str, Any]
) -> list[str]:
    parts = [
        f'<h2><span class="method">{method.upper()}</span> {escape(path)}</h2>',
        f"<p>{_marked(operation.get('description', ''))}</p>",
    ]
    rows = [
        (f"{one['name']} ({one['in']})", one.get("description", ""), one["schema"])
        for one in operation.get("parameters", ())
    ]
    body = operation.get("requestBody", {}).get("content", {}).get("application/json", {})
    for name in _references(body.get("schema", {})):
        for key, schema in schemas[name].get("properties", {}).items():
            rows.append((key, schema.get("description", ""), schema))
    if rows:
        lines = [
            f"<tr><td><code>{escape(name)}</code><td>{escape(_kind(schema))}<td>{escape(text)}"
            for name, text, schema in rows
        ]
        parts.append(f"<table>{''.join(lines)}</table>")
    return parts


def _marked(text: str) -> str:
    return re.sub(r"`([^`]+)`", r"<code>\1</code>", escape(text))


def _references(schema: dict[str, Any]) -> list[str]:
    found = [schema, *schema.get("anyOf", []), *schema.get("oneOf", [])]
    return [one["$ref"].rpartition("/")[2] for one in found if "$ref" in one]


def _kind(schema: dict[str, Any]) -> str:
    kind = schema.get("type") or " or ".join(one.get("type", "") for one in schema.get("anyOf", ()))
    default = f", {schema['default']!r} by default" if "default" in schema else ""
    return f"{kind}{default}"


_ABOUT = """State, motion and figures of one robot's control loop.

Reading needs only the connection. `enable`, `program` and `set` need the right to move:
`POST /control` gives it to one client at a time. Send its token in the header `X-Control-Token`.
`hold`, `disable` and `shutdown` are open to every client with access, without a limit of requests.
With too many connections over TCP, the answer to any request is status 503 with plain text: send a
stop again then.
Clients that request a stop at the same time get the same answer. A stop cancels waiting commands.
"""
_STATUS: Final[dict[type[Exception], HTTPStatus]] = {
    LeaseError: HTTPStatus.CONFLICT,
    PlannerBusyError: HTTPStatus.CONFLICT,
    LoopGoneError: HTTPStatus.SERVICE_UNAVAILABLE,
    LoopBusyError: HTTPStatus.SERVICE_UNAVAILABLE,
    CommandTooLongError: HTTPStatus.REQUEST_ENTITY_TOO_LARGE,
    StreamError: HTTPStatus.NOT_FOUND,
    InjectionError: HTTPStatus.CONFLICT,
    RecordingsBusyError: HTTPStatus.CONFLICT,
    ProcedureError: HTTPStatus.CONFLICT,
    DescribingError: HTTPStatus.CONFLICT,
    DriveTextsError: HTTPStatus.CONFLICT,
}
_ERRORS: Final[dict[int | str, dict[str, Any]]] = {
    400: {"model": models.Error, "description": "The body is not JSON"},
    401: {"model": models.Error, "description": "The key is missing or wrong"},
    403: {"model": models.Error, "description": "Origin or Host names another host"},
    408: {"model": models.Error, "description": "The body arrived too slowly"},
    413: {"model": models.Error, "description": "The body is too long"},
    422: {"model": models.Error, "description": "Invalid key or value"},
    429: {"model": models.Error, "description": "Too many requests; never for a stop"},
}
_REFUSALS: Final[dict[int | str, dict[str, Any]]] = {
    409: {
        "model": models.Error,
        "description": "Rejected by the loop's state, or another client holds the right to move",
    },
    503: {"model": models.Error, "description": "No loop accepts commands"},
}
_NO_STREAM: Final[dict[int | str, dict[str, Any]]] = {
    404: {"model": models.Error, "description": "No set-point stream is received"},
}
_NO_PAGE: Final[dict[int | str, dict[str, Any]]] = {
    404: {"model": models.Error, "description": "No page is served"},
}
_NO_SIMULATION: Final[dict[int | str, dict[str, Any]]] = {
    404: {"model": models.Error, "description": "The robot has real drives"},
}
_TOKEN_MOST = 64
Token = Annotated[
    str | None,
    Header(
        alias="X-Control-Token",
        max_length=_TOKEN_MOST,
        description="The token from `POST /control`.",
    ),
]


_ALL_STOPS: Final = 2**53


def _stops_before(
    request: Request,
    seen: Annotated[
        int,
        Header(
            alias="X-Stops-Seen",
            ge=0,
            le=_ALL_STOPS,
            description="`stop_count` of the last status that the client has seen: a later stop "
            "cancels the request, also if the network delays the request. By default the number "
            "when the request arrives.",
        ),
    ] = _ALL_STOPS,
) -> int:
    """Return the number of stops before a request."""
    return min(seen, int(request.scope[STOPS_BEFORE]))


StopsBefore = Annotated[int, Depends(_stops_before)]


class _LoopRefusedError(Exception):
    def __init__(self, reply: Reply) -> None:
        super().__init__(reply.text)
        self.reply = reply


def create_app(service: Service) -> FastAPI:
    """Return the application that serves `service`; it does not listen yet."""
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
    _add_drives(app, service)
    _add_simulation(app, service)
    add_recordings(app, service)
    _add_procedures(app, service)
    _add_describing(app, service)
    WebSocketRoutes(service).add(app)
    add_page(app)
    _add_key(app)
    _add_programs(app, service)
    return app


def _add_programs(app: FastAPI, service: Service) -> None:
    """Describe the robot's programs in the application's description, once the loop is known."""
    described = app.openapi()  # the application caches it
    schemas = described["components"]["schemas"]

    def openapi() -> dict[str, Any]:
        robot = service.link.description()
        if names := robot.get("programs"):
            own = ". ".join(
                f"{name}: {one['text']} {_bounds(one['arguments'])}".rstrip()
                for name, one in robot.get("own_programs", {}).items()
            )
            for schema in ("Enable", "ProgramRequest"):
                name = schemas[schema]["properties"]["program"]
                name["examples"] = names
                name["description"] = f"A program's name. {own}".rstrip()
        return described

    app.openapi = openapi  # type: ignore[method-assign]


def _bounds(arguments: Mapping[str, Any]) -> str:
    each = (
        f"{key} from {bounds['low']:g} to {bounds['high']:g}, {bounds['default']:g} by default"
        for key, bounds in arguments.items()
    )
    return f"({'; '.join(each)})" if arguments else ""


def _add_key(app: FastAPI) -> None:
    """Describe the key: `AccessControl` requires it before any request comes here."""
    described = app.openapi()  # the application caches it
    described["components"]["securitySchemes"] = {
        "key": {
            "type": "http",
            "scheme": "bearer",
            "description": "The shared key; not needed on the Unix socket.",
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
        return _error(HTTPStatus.UNPROCESSABLE_ENTITY, models.fault_text(first))

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
    readable = text.encode("utf-8", "backslashreplace").decode()  # it may repeat the request
    body = {"error": readable, "state": None, **of_loop}
    return JSONResponse(body, status, headers)


def _add_reading(app: FastAPI, service: Service) -> None:
    metrics = MetricsCollector(service)

    @app.get("/status")
    async def status() -> models.Status:
        """The complete status; needs no key from any address."""
        return models.Status.model_validate(service.status())

    @app.get("/description")
    async def description() -> dict[str, Any]:
        """The robot: axes, limits, programs; {} until the loop knows it."""
        return service.link.description()

    @app.get("/events")
    async def events(
        after: Annotated[
            int, Query(ge=0, le=2**53, description="Only events after this number.")
        ] = 0,
        most: Annotated[
            int,
            Query(ge=1, le=512, description="Largest number of events; the newest are returned."),
        ] = 100,
    ) -> models.Events:
        """Events: states, reasons with their values, commands, who may move."""
        return models.Events.model_validate({"events": service.events.since(after, most)})

    @app.get("/metrics", response_class=Response, responses={200: {"content": {"text/plain": {}}}})
    async def prometheus() -> Response:
        """Figures for Prometheus."""
        return Response(metrics.text(), media_type="text/plain; version=0.0.4; charset=utf-8")

    @app.get("/page-address", responses=_NO_PAGE)
    async def page_address() -> models.PageAddress:
        """The page's address with its key; only on the Unix socket."""
        if not service.page_url:
            raise HTTPException(404, "no page: the daemon was started with --no-page")
        return models.PageAddress(url=service.page_url)

    @app.get("/docs", include_in_schema=False)
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
        """Take the right to move; it expires `ttl_s` after the last request with the token."""
        token = service.lease.take(body.client, body.ttl_s)
        return models.ControlTaken(token=token, ttl_s=body.ttl_s)

    @app.put("/control", responses=_REFUSALS)
    async def renew(token: Token = None) -> models.Renewed:
        """Renew the right to move."""
        return models.Renewed(ttl_s=service.lease.renew(token).ttl_s)

    @app.delete("/control", responses=_REFUSALS)
    async def release(token: Token = None) -> models.Control:
        """Release the right to move; a motion under it holds."""
        service.lease.release(token)
        return models.Control.model_validate(service.control())

    @app.post("/ticket")
    async def ticket() -> models.Ticket:
        """Get a ticket for one WebSocket without the key: `/live?ticket=T`, `/control?ticket=T`.

        It also serves for one download of a recording. Browsers need it, because they send no
        `Authorization` with either.
        """
        return models.Ticket(ticket=service.tickets.issue(), valid_s=VALID_S)

    @app.post("/stream", responses={**_REFUSALS, **_NO_STREAM})
    async def stream(token: Token = None) -> models.StreamAccess:
        """Get a session of the set-point stream, which replaces the one before.

        It lasts as long as the right to move; `session` and `key` sign the packets.
        """
        return models.StreamAccess.model_validate(service.issue_stream_session(token))


_OPEN_COMMANDS: Final = {
    "configure": "Boot the drives; the power stays off.",
    "check": "Run the cycle without power and see whether all drives answer: inactive to ready.",
    "acknowledge": "Acknowledge a fault whose cause is gone; the power stays off.",
    "hold": "Stop the motion and hold the position with power; every client with access "
    "may do this.",
    "disable": "Stop the motion, then switch the power off; every client with access may do this.",
    "shutdown": "Stop the motion, switch the power off, end the daemon; every client with "
    "access may do this.",
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
        request: Request,
        stops: StopsBefore,
        body: models.Enable | None = None,
        token: Token = None,
    ) -> models.Done:
        """Give the drives power and run a program."""
        body = body or models.Enable()
        fields = {"program": body.program, "wanted": body.wanted, "stops": stops}
        return await ask("enable", body, token, request, **fields)

    @app.post("/program", responses=_REFUSALS)
    async def program(
        body: models.ProgramRequest, request: Request, stops: StopsBefore, token: Token = None
    ) -> models.Done:
        """Change to a program, without a torque step."""
        fields = {"program": body.program, "wanted": body.wanted, "stops": stops}
        return await ask("program", body, token, request, **fields)

    @app.post("/set", responses=_REFUSALS)
    async def change(
        body: models.Set, request: Request, stops: StopsBefore, token: Token = None
    ) -> models.Done:
        """Change arguments of the running program."""
        return await ask("set", body, token, request, wanted=body.wanted, stops=stops)

    @app.post("/lengths", responses=_REFUSALS)
    async def lengths(body: models.Set, request: Request, token: Token = None) -> models.Done:
        """Set the present lengths of the cables: `cable_length_m`, one for each axis or null."""
        return await ask("lengths", body, token, request, wanted=body.wanted)


def _add_drives(app: FastAPI, service: Service) -> None:
    @app.get("/drives", responses=_REFUSALS)
    async def drives() -> models.Drives:
        """What the drives report, as text, and the planned load of the buses."""
        texts, row = service.drives, newest_row(service.block)
        if texts is None or row is None:
            return models.Drives(drives=[], buses=[])
        words = row["statusword"].tolist()
        found = await asyncio.to_thread(
            lambda: {"drives": texts.drives(words), "buses": texts.buses()}
        )
        return models.Drives.model_validate(found)

    @app.post("/object", responses=_REFUSALS)
    async def drive_object(
        body: models.ObjectRequest, request: Request, token: Token = None
    ) -> models.DriveObject:
        """Read an object of a drive; or write an integer without power, with the right to move.

        After writing, all drives boot again.
        """
        fields = {"axis": body.axis, "index": body.index, "sub": body.sub, "value": body.value}
        if body.value is None:
            reply = await service.command("object", body.client, **fields)
        else:
            gone = request.is_disconnected
            reply = await service.command_with_right("object", body.client, token, gone, **fields)
        text, texts = _done(reply).text, service.drives
        data = bytes.fromhex(text.strip("-"))
        if texts is None or body.value is not None:
            written = body.value is not None
            return models.DriveObject(name="", text="written" if written else text, raw=text)
        found = await asyncio.to_thread(texts.object, body.axis, body.index, body.sub, data)
        return models.DriveObject.model_validate(found)


def _add_simulation(app: FastAPI, service: Service) -> None:
    @app.post("/simulated-fault", responses={**_REFUSALS, **_NO_SIMULATION})
    async def simulated_fault(body: models.SimulatedFault) -> models.Injected:
        """Break a simulated drive or cable, or mend it; only for a simulated robot."""
        if service.inject is None:
            raise HTTPException(404, "only a simulated robot can be broken on request")
        text = await asyncio.to_thread(service.inject, body.axis, body.fault)
        service.events.add("simulation", f"{text} by {body.client}")
        return models.Injected(text=text)


def _add_procedures(app: FastAPI, service: Service) -> None:
    procedures = service.procedures

    @app.post("/procedure", responses=_REFUSALS)
    async def begin(
        body: models.ProcedureRequest, stops: StopsBefore, token: Token = None
    ) -> models.ProcedureJob:
        """Begin a procedure: commissioning or calibration; needs the right to move throughout."""
        if stops != service.block.stops:
            raise ProcedureError(f"{body.procedure}: cancelled by a later stop")
        job = await procedures.begin(body, body.client, token)
        return models.ProcedureJob.model_validate(job)

    @app.get("/procedure")
    async def present() -> models.ProcedureJob:
        """The running procedure, or the last one."""
        return models.ProcedureJob.model_validate(procedures.job())

    @app.delete("/procedure")
    async def cancel() -> models.ProcedureJob:
        """End the procedure under control; a second request removes the power immediately."""
        procedures.end("cancelled")
        return models.ProcedureJob.model_validate(procedures.job())

    @app.get("/procedure/curves")
    async def curves() -> models.Curves:
        """The newest part of the measurement that runs."""
        found = await asyncio.to_thread(procedures.curves)
        return models.Curves.model_validate(found)

    @app.get(REPORTS_PREFIX + "{secret}/{name:path}", include_in_schema=False)
    async def report(secret: str, name: str) -> Response:
        found = await asyncio.to_thread(procedures.find, secret, name)
        if found is None:
            raise HTTPException(404)
        path, kind = found
        return FileResponse(path, headers={**REPORT_HEADERS, "content-type": kind})


def _add_describing(app: FastAPI, service: Service) -> None:
    @app.post("/robot-file", responses=_REFUSALS)
    async def describe(body: models.DescribeRobot) -> models.RobotDescription:
        """Describe a robot by answers, or diagnose it; changes nothing."""
        found = await service.describe(body.model_dump())
        return models.RobotDescription.model_validate(found)

    @app.put("/robot-file", responses=_REFUSALS)
    async def save(body: models.SaveRobot) -> models.RobotSaved:
        """Save a described robot as the user's own profile; needs consent to replace a file."""
        saved = await service.describe(body.model_dump())
        service.events.add("robot-file", f"{saved['file']} written by {body.client}")
        return models.RobotSaved.model_validate(saved)


def _add_path(app: FastAPI, service: Service) -> None:
    @app.post("/path", responses=_REFUSALS)
    async def plan_path(body: models.PathFile) -> models.Planned:
        """Begin to plan a path for the robot; `GET /path` shows when it is planned."""
        return models.Planned.model_validate(service.planner.begin(body.model_dump()))

    @app.get("/path")
    async def planned_path() -> models.Planned:
        """The path that was planned last, or why the robot cannot follow it.

        The program `path` follows it by the name in `plan`.
        """
        return models.Planned.model_validate(service.planner.job)

    @app.get("/workspace", responses=_REFUSALS)
    async def workspace() -> models.Border:
        """The border of the positions where the cables can hold the platform at rest.

        The first answer takes some seconds.
        """
        return models.Border.model_validate(await service.border.get())


def _done(reply: Reply) -> models.Done:
    if not reply.ok:
        raise _LoopRefusedError(reply)
    return models.Done(text=reply.text, state=reply.state)
