"""JSON models of the control interface."""

from __future__ import annotations

import re
from typing import Annotated, Any, Final, Literal

from pydantic import AfterValidator, BaseModel, ConfigDict, Field, WithJsonSchema, model_validator
from pydantic_core import ErrorDetails

from cdpr_profiles.errors import brief
from cdpr_rt.loop.right import LONGEST_S
from cdpr_rt.refusal import RefusalCode
from cdpr_rt.service.lease import SHORTEST_S

_MOST_KEYS, _MOST_NUMBERS, _LARGEST = 32, 64, 1e9
_KEY: Final = "^[A-Za-z][A-Za-z0-9_]{0,39}$"
_TEXT: Final = "^[ -~]{0,64}$"
_SCALAR: Final[list[dict[str, Any]]] = [
    {"type": "number", "minimum": -_LARGEST, "maximum": _LARGEST},
    {"type": "string", "pattern": _TEXT},
    {"type": "boolean"},
    {"type": "null"},
]
_LIST: Final = {"type": "array", "items": {"anyOf": _SCALAR}, "maxItems": _MOST_NUMBERS}
_WANTED: Final[dict[str, Any]] = {
    "type": "object",
    "propertyNames": {"pattern": _KEY},
    "maxProperties": _MOST_KEYS,
    "additionalProperties": {"anyOf": [*_SCALAR, _LIST]},
}


def _check_scalar(key: str, value: Any) -> None:
    if isinstance(value, int | float):
        good = abs(value) <= _LARGEST  # also rejects whole numbers beyond the range of a float
    else:
        good = value is None or (isinstance(value, str) and re.fullmatch(_TEXT, value) is not None)
    if not good:
        raise ValueError(
            f"{key}: allowed: a number up to {_LARGEST:g}, 64 characters of ASCII, true, false, "
            f"null, or a list of {_MOST_NUMBERS} of these"
        )


def _checked(arguments: dict[str, Any]) -> dict[str, Any]:
    """Raise ValueError for arguments that no program accepts; `_WANTED` states the same."""
    if len(arguments) > _MOST_KEYS:
        raise ValueError(f"{len(arguments)} keys; allowed: {_MOST_KEYS}")
    for key, value in arguments.items():
        if re.fullmatch(_KEY, key) is None:
            raise ValueError("key; allowed: a letter, then up to 39 letters, digits and _")
        values = value if isinstance(value, list) else [value]
        if len(values) > _MOST_NUMBERS:
            raise ValueError(f"{key}: {len(values)} values; allowed: {_MOST_NUMBERS}")
        for one in values:
            _check_scalar(key, one)
    return arguments


def fault_text(fault: ErrorDetails) -> str:
    """Return the error and its place, in a text of bounded length."""
    where = ".".join(brief(str(part), 60) for part in fault["loc"])
    return f"{where}: {brief(fault['msg'])}"


_Name = Annotated[str, Field(pattern=r"^[a-z][a-z0-9_-]{0,31}$", description="A program's name.")]
_Client = Annotated[
    str,
    Field(
        pattern=r"^[ -~]{1,64}$",
        description="Name of the client, shown to others: 1 to 64 characters of printable ASCII.",
        examples=["maria@laptop"],
    ),
]
_Wanted = Annotated[
    dict[str, Any],
    AfterValidator(_checked),
    WithJsonSchema(_WANTED),
    Field(
        description="Arguments of the program; see the page about programs.",
        examples=[{"position_m": [0.2, 0.1, 1.8], "rotation_rad": [0.0, 0.0, 0.1]}],
    ),
]


class _Body(BaseModel):
    model_config = ConfigDict(extra="forbid")

    @model_validator(mode="before")
    @classmethod
    def _keep_one_unknown_key(cls, body: Any) -> Any:
        """Remove all unknown keys but the first: each would be reported, and one is enough."""
        if not isinstance(body, dict) or len(body) <= len(cls.model_fields):
            return body
        unknown = next(key for key in body if key not in cls.model_fields)
        return {key: body[key] for key in (*cls.model_fields, unknown) if key in body}


class ClientRequest(_Body):
    """The client's name, for the record of events; the whole body may be omitted."""

    client: _Client = "somebody"


class TakeControl(_Body):
    """The client that wants to move, and how long it may be silent."""

    client: _Client
    ttl_s: Annotated[
        float,
        Field(
            ge=SHORTEST_S,
            le=LONGEST_S,
            description="The robot holds if the client is silent for this time.",
        ),
    ] = 2.0


class Enable(ClientRequest):
    """The program that runs from the first moment with power."""

    program: _Name = "hold"
    wanted: _Wanted = {}


class ProgramRequest(ClientRequest):
    """The program to run from now on."""

    program: _Name
    wanted: _Wanted = {}


class PathFile(ClientRequest):
    """A path's file to plan."""

    name: Annotated[
        str,
        Field(
            pattern=r"^[A-Za-z0-9][A-Za-z0-9_. -]{0,59}\.(toml|csv|nc|ngc|gcode|tap|cnc)$",
            description="File name; its ending gives the format.",
            examples=["part.nc"],
        ),
    ]
    text: Annotated[str, Field(max_length=1 << 21, description="Content of the file.")]
    origin_mm: Annotated[
        str | None,
        Field(
            pattern=r"^[-+.0-9G ]{1,200}$",
            description="Position of G-code's zero in the room, then those of G55 to G59.",
        ),
    ] = None
    blend_mm: Annotated[
        float, Field(ge=0, le=1000, description="Tolerance for cutting corners of G-code.")
    ] = 1.0
    ignore: Annotated[
        str, Field(pattern=r"^[A-Za-z0-9._ ]{0,256}$", description="Words of G-code to ignore.")
    ] = ""
    z_mm: Annotated[float | None, Field(ge=-1e6, le=1e6, description="Z for G-code without Z.")] = (
        None
    )
    scale: Annotated[
        float, Field(ge=1e-3, le=1e3, description="Scale factor of G-code's lengths.")
    ] = 1.0
    rotate_deg: Annotated[
        float, Field(ge=-360, le=360, description="Rotation of G-code about Z.")
    ] = 0.0
    mirror: Annotated[
        str, Field(pattern="^(x|y)?$", description="Axis along which G-code is mirrored, if any.")
    ] = ""
    dwell: Annotated[str, Field(pattern="^(s|ms)$", description="Unit of P of G4.")] = "s"
    line: Annotated[int, Field(ge=0, le=1 << 24, description="Line of the file to begin with.")] = 0


class SimulatedFault(ClientRequest):
    """A fault for one axis of a simulated robot, or its repair."""

    axis: Annotated[int, Field(ge=0, le=63, description="Number of the axis, from 0.")]
    fault: Annotated[
        str,
        Field(
            pattern="^[a-z-]{1,32}$",
            description="A fault of `cdpr sim fault`, such as cut-cable; mend repairs them.",
        ),
    ]


_AxisName = Annotated[str, Field(min_length=1, max_length=64, description="Name of an axis.")]
_Mass = Annotated[float, Field(ge=0.05, le=1000.0)]


class Commission(ClientRequest):
    """Identify motors, one after the other; each must be detached from its load."""

    procedure: Literal["commission"]
    axes: Annotated[list[_AxisName], Field(min_length=1, max_length=64)]
    detached: Literal[True] = Field(description="The client confirms that the motors turn freely.")
    quick: bool = False


class CalibrateTension(ClientRequest):
    """Identify the friction and the gain of a simulated winch from hung masses."""

    procedure: Literal["tension"]
    axis: _AxisName
    masses_kg: Annotated[list[_Mass], Field(min_length=3, max_length=10)]


class MeasurePoses(ClientRequest):
    """Move the tight platform from home through poses and identify the geometry; adopt nothing."""

    procedure: Literal["measure"]
    poses: Annotated[
        int | None, Field(ge=2, le=200, description="Number of poses; null: as many as help.")
    ] = None
    camera: bool = Field(default=False, description="Use the camera of the simulated platform.")


class AdoptCalibration(ClientRequest):
    """Adopt the geometry of the last measurement, from the next start on."""

    procedure: Literal["adopt"]
    measurement: Annotated[str, Field(pattern="^calibrate-[0-9]{8}-[0-9]{6}$")]
    insignificant: bool = Field(
        default=False, description="Adopt the calibration even if its changes are not significant."
    )


class CheckCalibration(ClientRequest):
    """Move the tight platform to ten poses and report whether the robot has changed."""

    procedure: Literal["check"]


class UndoCalibration(ClientRequest):
    """Undo the calibration in force, from the next start on."""

    procedure: Literal["undo"]


class CalibrateLens(ClientRequest):
    """Calibrate the lens of the simulated platform's camera with images of a board."""

    procedure: Literal["lens"]
    images: Annotated[int, Field(ge=5, le=100)] = 30


ProcedureRequest = Annotated[
    Commission
    | CalibrateTension
    | MeasurePoses
    | AdoptCalibration
    | CheckCalibration
    | UndoCalibration
    | CalibrateLens,
    Field(discriminator="procedure"),
]


_Answers = Annotated[
    dict[
        Annotated[str, Field(pattern=_KEY)],
        Annotated[str, Field(max_length=200, pattern=r"^[^\x00-\x1f\x7f]*$")],
    ],
    Field(
        max_length=80,
        description="Answers to the questions of `cdpr robot new`, by key.",
        json_schema_extra={"additionalProperties": False},
    ),
]


class DescribeRobot(_Body):
    """A robot to describe; questions without an answer have their defaults."""

    answers: _Answers = {}
    present: bool = Field(default=False, description="Begin with the answers of this robot.")
    diagnose: bool = Field(
        default=False,
        description="Check the robot instead of describing it; this takes some seconds.",
    )


class SaveRobot(ClientRequest):
    """A described robot to save as the user's own profile."""

    answers: _Answers
    name: Annotated[str, Field(pattern="^[a-z0-9][a-z0-9_-]{0,39}$")]
    replace: bool = Field(default=False, description="Replace an existing file.")


class Set(ClientRequest):
    """New arguments of the running program."""

    wanted: _Wanted


class ObjectRequest(ClientRequest):
    """An object of a drive, to read or to write."""

    axis: Annotated[int, Field(ge=0, le=63, description="Number of the axis, from 0.")]
    index: Annotated[int, Field(ge=0, le=0xFFFF)]
    sub: Annotated[int, Field(ge=0, le=0xFF)] = 0
    value: Annotated[
        int | None,
        Field(ge=-(1 << 63), lt=1 << 64, description="Write this integer; without it, only read."),
    ] = None


class _Answer(BaseModel):
    model_config = ConfigDict(extra="allow")


class Refusal(_Answer):
    """Why the loop has refused a command, for programs."""

    code: RefusalCode
    command: str
    """The command, or the program that it was for."""
    asked: dict[str, Any]
    """The refused keys of `wanted` and their values."""
    arguments: dict[str, Any]
    """Arguments of the code, such as `low` and `high`."""


class Error(_Answer):
    """Why something was refused or failed."""

    error: str
    state: str | None = None
    """The loop's state, if the loop refused or no loop takes commands."""
    refusal: Refusal | None = None
    """The loop's reason, if it has a code."""


class Done(_Answer):
    """The loop has carried out the command."""

    text: str
    state: str


class Injected(_Answer):
    """What is broken or mended now."""

    text: str


class Planned(_Answer):
    """A path that is being planned, or was planned last."""

    number: int
    """One more for each path."""
    planning: bool
    error: str | None
    """Why the robot cannot follow it; gives line and coordinates of the first such place."""
    plan: str | None
    """The name of the plan for the program `path`."""
    route_m: list[list[float]] | None = None
    """Positions at even distances along the path, also if the robot cannot follow it."""
    duration_s: float | None = None
    length_m: float | None = None
    next_line: int | None = None
    """The line with which the next plan begins, null if this one ends the path."""
    notices: list[str] = []


class ProcedureStep(_Answer):
    """Progress of a part of a procedure."""

    what: str
    share: float | None
    """From 0 to 1; null if its duration is not known."""


class Report(_Answer):
    """A report that can be read without the key, at a path that nobody can guess."""

    title: str
    path: str


class ProcedureJob(_Answer):
    """The procedure that runs, or the last one."""

    number: int
    """One more for each procedure; 0 before the first."""
    procedure: str
    """Its name in the request; empty before the first."""
    what: str
    client: str
    running: bool
    ending: str
    """Why it ends or has ended early; empty if it does not."""
    steps: list[ProcedureStep]
    lines: list[str]
    """The last lines that it has printed."""
    error: str
    """Why it failed; empty if it did not."""
    result: dict[str, Any] | None
    """The figures that it printed at its end."""
    reports: list[Report]
    values: dict[str, Any]
    """Further facts, such as its folder."""
    offers: dict[str, Any]
    """Facts about the robot, such as `simulated_camera`."""


class Curves(_Answer):
    """The newest part of the present measurement; an empty list for each without one."""

    name: str
    time_s: list[float]
    error_deg: list[float | None]
    torque_Nm: list[float | None]


class RobotQuestion(_Answer):
    """A question about a robot, and its answer."""

    key: str
    text: str
    value: str
    default: str
    origin: str
    """Where the default comes from."""
    problem: str
    """What is wrong with the answer, so that the default is used; empty if it is valid."""
    choices: list[str]
    """The possible answers; empty if there are too many."""


class RobotFinding(_Answer):
    """What cannot work, or is doubtful, and the change to make."""

    key: str
    text: str
    impossible: bool


class RobotDescription(_Answer):
    """A described robot; without `diagnose`, its questions and file, else what is wrong with it."""

    questions: list[RobotQuestion] = []
    toml: str = ""
    platform: dict[str, Any] = {}
    """As in the description of a running robot."""
    notes: list[str] = []
    """Properties of the present robot that the questions leave out."""
    folder: str = ""
    writable: bool = False
    findings: list[RobotFinding] = []
    figures: dict[str, float] = {}


class RobotSaved(_Answer):
    """The file that describes the robot."""

    file: str


class Border(_Answer):
    """The border of a workspace: in a plane a polygon, in space triangles."""

    points_m: list[list[float]]
    triangles: list[list[int]]
    """Numbers of the points of each triangle, empty in a plane."""


class ControlTaken(_Answer):
    """The right to move, for the client that shows the token."""

    token: str
    ttl_s: float


class Renewed(_Answer):
    """The right to move is renewed."""

    ttl_s: float


class Ticket(_Answer):
    """A ticket that opens one WebSocket, as `ticket=` of its query."""

    ticket: str
    valid_s: float


class PageAddress(_Answer):
    """Address of the page, with the key that moves the robot."""

    url: str


class StreamAccess(_Answer):
    """A session of the set-point stream, for the holder of the right to move."""

    session: int
    key: str = Field(description="32 bytes in hexadecimal; signs the packets.")
    host: str = Field(description="Address of the stream; 0.0.0.0 is every address.")
    port: int


class Control(_Answer):
    """Who holds the right to move."""

    held: bool
    client: str | None
    left_s: float
    procedure: str
    """The client's procedure that moves the robot instead of the client; empty without one."""


class LoopLife(_Answer):
    """The loop's process."""

    pid: int
    alive: bool
    silent_s: float
    """Time since its last turn."""


class Status(_Answer):
    """The complete status."""

    robot: str
    state: str
    """unconfigured, inactive, ready, active, fault; starting, dead."""
    program: str | None
    commanded: str = ""
    """The last command that decided what runs, and its sender; empty before the first."""
    program_progress: dict[str, Any] = {}
    """Progress of the program, such as `done`; for a platform `position_m`, `rotation_rad`, ..."""
    failure: str = ""
    """Program that failed last and why; empty from the next motion on."""
    reason: str
    """Why it left active, holds, or is not ready; stays until acknowledged or enabled again."""
    reason_limit: dict[str, Any] | None
    """The first of `faults` and the reaction to it, null if the reason is not a fault."""
    faults: list[dict[str, Any]]
    """All failures, the cause first: `limit`, `axis` (from 0), `name`, `code`, `text`, ..."""
    released: bool = False
    """Whether a procedure runs the drives instead of the loop."""
    stop_count: int
    """Number of stops so far, for the header `X-Stops-Seen`."""
    read_only: bool
    lockstep: bool
    notices: list[str]
    loop: LoopLife
    control: Control
    cycle: dict[str, Any] | None
    """Figures of the newest cycle, null before the first."""
    axes: list[dict[str, Any]]
    calibration: dict[str, Any] | None
    """Calibration of the geometry in use, null for the robot's file."""
    parts: dict[str, dict[str, Any]]
    """Recorder, live view, set-point stream and the service's own figures."""


class Event(_Answer):
    """Something that happened."""

    number: int
    time: str
    """Date and time, UTC."""
    kind: str
    text: str
    times: int
    """Number of times that it happened in succession."""
    detail: dict[str, Any]


class Events(_Answer):
    """The last events, oldest first."""

    events: list[Event]


class Quantity(_Answer):
    """A quantity of a cycle; its unit is the end of its name."""

    name: str
    meaning: str
    per: Literal["robot", "axis", "pose"]
    """Whether it has one value, one for each axis, or x, y, z and a quaternion w, x, y, z."""
    labels: dict[int, str] | None
    """Names of its numbers, if it is a state or the like."""


class Fields(_Answer):
    """All quantities of a cycle."""

    fields: list[Quantity]


class Recording(_Answer):
    """One file of a recording."""

    name: str
    session: str
    part: int
    """Number of the file in its session, from 1."""
    begin: str
    """Date and time of its first message, UTC."""
    duration_s: float
    bytes: int
    live: bool
    """Whether it is being written."""


class Recordings(_Answer):
    """The recordings of this robot, newest first."""

    recordings: list[Recording]


class Columns(_Answer):
    """Curves of a recording."""

    time_s: list[float]
    """Time since the first cycle."""
    columns: dict[str, list[float | None]]
    """Values by name, such as `tension_N[left]`."""
    cycles: int
    """Number of cycles."""
    each: int
    """Number of cycles per pair of values, the smallest and the largest; 1 if all are there."""


class StatusBit(_Answer):
    """One bit of a statusword."""

    bit: int
    name: str
    on: bool


class Drive(_Answer):
    """What one drive reports."""

    name: str
    bus: str
    node_id: int
    drive: str
    """Its profile."""
    state: str
    """The statusword as text."""
    bits: list[StatusBit]
    mode: str
    """The mode of operation in which it accepts torques."""


class Bus(_Answer):
    """One bus of the robot."""

    name: str
    load: float
    """Share of a cycle that SYNC, PDOs and heartbeats need in the worst case."""
    bitrate_bit_s: int


class Drives(_Answer):
    """The drives and buses of the robot."""

    drives: list[Drive]
    buses: list[Bus]


class DriveObject(_Answer):
    """Value of an object of a drive."""

    name: str
    """Its name in the electronic data sheet, "" if it has none."""
    text: str
    raw: str
    """Its bytes in hexadecimal, the lowest first."""
