"""`cdpr move` of a platform: input in mm and degrees, and rejections."""

from __future__ import annotations

import json
import math
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import pytest
import typer
from typer.testing import CliRunner

from cdpr_rt.refusal import CommandRefusal, RefusalCode
from cdpr_tools.client.refusals import DaemonRefusalError
from cdpr_tools.client.status_text import platform_text
from cdpr_tools.commands import daemon_motion, with_daemon
from cdpr_tools.commands.daemon_motion import PlatformMove, ReferenceFrame
from cdpr_tools.errors import BadInputError, CommandError, WorkFailedError

PLANE = {
    "home_m": [0.0, 1.3],
    "workspace_min_m": [-0.6, 1.4],
    "workspace_max_m": [0.6, 2.4],
    "speed_m_s": 0.5,
    "controlled": ["x", "y"],
    "home_rotation_rad": [0.0],
    "workspace_angle_rad": 0.0,
}
TURNING = PLANE | {"controlled": ["x", "y", "angle"], "workspace_angle_rad": math.radians(15.0)}
ROOM = {
    "home_m": [0.0, 0.0, 0.5],
    "workspace_min_m": [-1.0, -1.0, 0.5],
    "workspace_max_m": [1.0, 1.0, 1.5],
    "speed_m_s": 0.5,
    "controlled": ["x", "y", "z", "rx", "ry", "rz"],
    "home_rotation_rad": [0.0, 0.0, 0.4],
    "workspace_angle_rad": math.radians(20.0),
}
NAMED = PLANE | {"poses_m": {"load": [0.3, 2.0]}}
HERE = {"target_m": [0.1, 0.2, 1.0], "target_rotation_rad": [0.1, -0.05, 0.2]}


class Told:
    """A stand-in for a daemon, with the requests of `cdpr move`."""

    def __init__(
        self,
        platform: dict[str, Any],
        progress: dict[str, Any] | None = None,
        refusal: CommandRefusal | None = None,
    ) -> None:
        self.platform, self.progress, self.refusal = platform, progress or {}, refusal
        self.posted: list[dict[str, Any]] = []
        self.ways: list[dict[str, Any]] = []
        """The progress before the motion is complete."""

    def get(self, path: str) -> dict[str, Any]:
        if path == "/description":
            return {
                "robot": "told", "axes": [], "platform": self.platform, "programs": ["hold", "pose"]
            }  # fmt: skip
        done = {**self.progress, "done": 1.0, "trouble": ""}
        if self.posted and self.ways:
            done |= {"done": 0.0, **self.ways.pop(0)}
        return {
            "state": "active",
            "loop": {"silent_s": 0.0},
            "program": "pose",
            "reason": "",
            "reacting": "none",
            "lockstep": False,
            "axes": [],
            "parts": {},
            "program_progress": done if self.posted else self.progress,
        }

    def post(self, path: str, body: dict[str, Any] | None = None, _token: str = "") -> Any:
        if path == "/program":
            if self.refusal:
                raise DaemonRefusalError.of(self.refusal)
            self.posted.append(body or {})
        return {"token": "one"}

    def renew(self, _token: str) -> None: ...
    def release(self, _token: str) -> None: ...


def wanted(
    told: Told,
    to: str | None = None,
    rotate: str | None = None,
    relative: bool = False,
    frame: ReferenceFrame = ReferenceFrame.ROOM,
    speed: float | None = None,
) -> dict[str, Any]:
    return PlatformMove(to, rotate, relative, frame, speed).arguments(told)  # type: ignore[arg-type]


def test_millimetres_and_degrees_are_converted_to_si() -> None:
    asked = wanted(Told(PLANE), "300 2000", speed=50.0)
    assert asked == {"position_m": [0.3, 2.0], "speed_m_s": 0.05}
    asked = wanted(Told(TURNING), rotate="-10")
    assert asked == {"rotation_rad": [pytest.approx(math.radians(-10.0))]}
    asked = wanted(Told(ROOM), "100 -200 700", "5 0 -10")
    assert asked["position_m"] == pytest.approx([0.1, -0.2, 0.7])
    assert asked["rotation_rad"] == pytest.approx([math.radians(5.0), 0.0, math.radians(-10.0)])


def test_a_pose_is_named_instead_of_numbers() -> None:
    assert wanted(Told(NAMED), "load") == {"position_m": [0.3, 2.0]}
    assert wanted(Told(ROOM), "home") == {"position_m": [0.0, 0.0, 0.5]}


def test_a_relative_motion_is_sent_as_distance_and_turn() -> None:
    asked = wanted(Told(ROOM), "50 20 -30", "3 -2 4", True, ReferenceFrame.PLATFORM)
    assert asked == {
        "distance_m": pytest.approx([0.05, 0.02, -0.03]),
        "turn_rad": pytest.approx([math.radians(angle) for angle in (3.0, -2.0, 4.0)]),
        "frame": "platform",
    }


@pytest.mark.parametrize(
    ("platform", "typed", "told"),
    [
        (PLANE, {"to": "0.3 2.0"}, "--to 0.3 2.0: are these metres.* --to 300 2000"),
        (PLANE, {"to": "abc"}, "--to abc: 'abc' is not a number; allowed: X Y in mm$"),
        (PLANE, {"to": "0 2000 5"}, "--to 0 2000 5: 3 numbers; allowed: 2, X Y in mm"),
        (ROOM, {"to": "0 2000"}, "--to 0 2000: 2 numbers; allowed: 3, X Y Z in mm"),
        (NAMED, {"to": "lod"}, "--to lod: 'lod' is not a number; allowed: X Y in mm, or load"),
        (NAMED, {"to": "load", "relative": True}, "--to load: is a pose, not a distance; omit"),
        (NAMED, {"to": "home"}, "--to home: home is on the stand, .*; `cdpr lower` puts"),
        (PLANE, {"to": "nan 2000"}, "--to nan 2000: allowed: finite numbers, X Y in mm"),
        (PLANE, {"rotate": "5"}, "--rotate 5: this platform has no controlled angle"),
        (TURNING, {"rotate": "1 2 3"}, "--rotate 1 2 3: 3 numbers; allowed: 1, ANGLE in deg"),
        (ROOM, {"rotate": "1"}, "--rotate 1: 1 number; allowed: 3, RX RY RZ in deg"),
        (PLANE, {"to": "5 0", "frame": ReferenceFrame.PLATFORM},
         "--frame platform: allowed only"),
    ],
)  # fmt: skip
def test_rejections_quote_the_input_as_typed(
    platform: dict[str, Any], typed: dict[str, Any], told: str
) -> None:
    with pytest.raises(BadInputError, match=told):
        wanted(Told(platform), **typed)


def test_the_status_shows_position_and_rotation_of_a_platform() -> None:
    progress = {
        "position_m": [0.1, 0.2, 0.3],
        "rotation_rad": [0.0, 0.0, math.radians(5.0)],
        "target_m": [0.0, 0.0, 0.0],
        "target_rotation_rad": [0.0, 0.0, 0.0],
        "trouble": "the way is blocked, at 500.0, 1000.0, 2000.0 mm: cable 1",
    }
    assert platform_text({"program_progress": progress}) == (
        "platform at 100.0, 200.0, 300.0 mm, turned by 0.00, 0.00, 5.00 deg; "
        "target 0.0, 0.0, 0.0 mm, turned by 0.00, 0.00, 0.00 deg; "
        "the way is blocked, at 500.0, 1000.0, 2000.0 mm: cable 1"
    )


# -- as typed


def typed(monkeypatch: pytest.MonkeyPatch, told: Told, *words: str, command: str = "move") -> Any:
    """Run `cdpr move`, or another command, with the stand-in for a daemon."""

    @contextmanager
    def opened(*_where: Any) -> Iterator[Told]:
        yield told

    monkeypatch.setattr(with_daemon, "open_daemon", opened)
    app = typer.Typer()
    app.add_typer(daemon_motion.app)
    return CliRunner().invoke(app, [command, *words])


@pytest.mark.parametrize(
    ("words", "asked"),
    [
        (["--to", "-50", "-200", "700"], {"position_m": [-0.05, -0.2, 0.7]}),
        (["--to=-50 -200 700"], {"position_m": [-0.05, -0.2, 0.7]}),
        (["--rotate", "0", "0", "-0.0", "--speed", "50"],
         {"rotation_rad": [0.0, 0.0, 0.0], "speed_m_s": 0.05}),
        (["--speed", "50", "--to", "1", "2", "700", "--rotate", "0", "-0", "0"],
         {"position_m": [0.001, 0.002, 0.7], "rotation_rad": [0.0, 0.0, 0.0], "speed_m_s": 0.05}),
    ],
)  # fmt: skip
def test_options_take_all_following_numbers(
    monkeypatch: pytest.MonkeyPatch, words: list[str], asked: dict[str, Any]
) -> None:
    told = Told(ROOM, HERE)
    result = typed(monkeypatch, told, *words, "--json")
    assert result.exit_code == 0, result.output
    assert told.posted[0]["wanted"] == {
        key: pytest.approx(value, abs=1e-12) for key, value in asked.items()
    }
    assert json.loads(result.stdout.splitlines()[-1])["arrived"] is True


@pytest.mark.parametrize(
    ("words", "asked"),
    [
        (["x=10"], {"distance_m": [0.01, 0.0, 0.0], "turn_rad": [0.0, 0.0, 0.0]}),
        (["z=-5", "rx=2"],
         {"distance_m": [0.0, 0.0, -0.005], "turn_rad": [math.radians(2.0), 0.0, 0.0]}),
    ],
)  # fmt: skip
def test_a_jog_along_a_direction_is_one_step_of_the_platform(
    monkeypatch: pytest.MonkeyPatch, words: list[str], asked: dict[str, Any]
) -> None:
    told = Told(ROOM, HERE)
    result = typed(monkeypatch, told, *words, command="jog")
    assert result.exit_code == 0, result.output
    assert told.posted[0]["wanted"] == {
        "frame": "room", **{key: pytest.approx(value) for key, value in asked.items()}
    }  # fmt: skip


@pytest.mark.parametrize("words", [["x=10", "left=3"], ["x=fast"], ["x=1", "x=2"], ["x"]])
def test_a_step_takes_each_direction_once(
    monkeypatch: pytest.MonkeyPatch, words: list[str]
) -> None:
    result = typed(monkeypatch, Told(ROOM, HERE), *words, command="jog")
    assert isinstance(result.exception, BadInputError)
    assert "allowed: x=MM, y=MM, z=MM, rx=DEG, ry=DEG, rz=DEG, each once" in str(result.exception)


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["--to"], "requires an argument"),
        (["--to", "1", "2", "left=3"], "cannot be combined with axes"),
        (["--frame", "platform", "left=3"], "--frame platform: allowed only with"),
        (["--to", "1", "2"], "2 numbers; allowed: 3, X Y Z in mm"),
    ],
)
def test_invalid_input_ends_with_a_message(
    monkeypatch: pytest.MonkeyPatch, words: list[str], message: str
) -> None:
    told = Told(ROOM, HERE)
    result = typed(monkeypatch, told, *words)
    assert result.exit_code != 0
    text = str(result.exception) if isinstance(result.exception, CommandError) else result.output
    assert message in text
    assert not told.posted


def test_a_step_from_the_stand_is_rejected_with_the_way_into_the_workspace(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    why = {"why": "leads to y 1320 mm", "outside": True, "enter_m": [0.0, 1.4]}
    refusal = CommandRefusal(RefusalCode.NOT_FEASIBLE, "pose", {"distance_m": [0, 0.02]}, why)
    result = typed(monkeypatch, Told(PLANE, refusal=refusal), "y=20", command="jog")
    assert isinstance(result.exception, BadInputError)
    assert str(result.exception).endswith("first `cdpr move --to 0 1400`")
    assert str(refusal).endswith("first position_m [0.0, 1.4]")


def test_a_rejection_by_the_daemon_quotes_the_typed_input(monkeypatch: pytest.MonkeyPatch) -> None:
    why = {"why": "cable 1 would need 9 N"}
    asked = {"position_m": [0.0, 0.0, 0.7]}
    told = Told(ROOM, HERE, CommandRefusal(RefusalCode.NOT_FEASIBLE, "pose", asked, why))
    result = typed(monkeypatch, told, "--to", "0", "0", "700")
    assert isinstance(result.exception, WorkFailedError)
    assert str(result.exception) == "--to 0 0 700: cable 1 would need 9 N"


class Fallen(Told):
    """A stand-in for a daemon whose platform has come down after a fault."""

    def get(self, path: str) -> dict[str, Any]:
        last_stop = {"broken": [], "fallen": True}
        status = {"program": "hold", "read_only": False, "last_stop": last_stop}
        return super().get(path) | (status if path == "/status" else {})


def test_a_move_of_a_fallen_platform_is_refused_with_the_next_step(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    loose = CommandRefusal(RefusalCode.NOT_TIGHT, "pose", {"position_m": [0.0, 0.0, 0.7]})
    told = Fallen(ROOM, HERE | {"tight": False}, loose)
    result = typed(monkeypatch, told, "--to", "0", "0", "700")
    assert isinstance(result.exception, WorkFailedError)
    assert str(result.exception) == "--to 0 0 700: the cables are not tight; run tighten first"
    (note,) = result.exception.__notes__
    assert note.startswith("next: look at the platform, which has come down")
    assert "`cdpr tighten --from home`" in note


def test_an_obstructed_platform_is_reported_once(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    told = Told(ROOM, HERE)
    told.ways = [{"held_back": f"the platform is {k} mm behind"} for k in (50, 51)]
    result = typed(monkeypatch, told, "--to", "0", "0", "700")
    assert result.exit_code == 0
    assert "50 mm behind" in result.output and "51 mm" not in result.output


def test_a_blocked_motion_ends_with_the_reason(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    told = Told(ROOM, HERE)
    told.ways = [
        {},
        {"trouble": "the way is blocked, at 100.0, 0.0, 700.0 mm: cable 1 would need 9 N"},
    ]
    result = typed(monkeypatch, told, "--to", "0", "0", "700")
    assert isinstance(result.exception, WorkFailedError)
    assert "the way is blocked, at 100.0, 0.0, 700.0 mm: cable 1" in str(result.exception)


def test_a_target_missed_by_friction_is_reported_and_the_move_succeeds(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    told = Told(ROOM, HERE)
    told.ways = [{"done": 1.0, "trouble": "the platform stands 1.2 mm from its target"}]
    result = typed(monkeypatch, told, "--to", "0", "0", "700", "--json")
    assert result.exit_code == 0
    figures = json.loads(result.stdout.splitlines()[-1])
    assert figures["trouble"] == "the platform stands 1.2 mm from its target"


def test_lower_reports_the_client_that_is_already_lowering(monkeypatch: pytest.MonkeyPatch) -> None:
    down = Told(ROOM)
    held = {"program": "lower", "control": {"held": True, "client": "a@b"}}
    told = down.get
    monkeypatch.setattr(down, "get", lambda path: told(path) | held)
    result = typed(monkeypatch, down, command="lower")
    assert isinstance(result.exception, WorkFailedError)
    assert "a@b is already lowering the platform" in str(result.exception)
    assert not down.posted


def test_move_without_a_platform_names_the_command_for_axes() -> None:
    bare = Told(PLANE)
    bare.platform = None  # type: ignore[assignment]
    with pytest.raises(BadInputError, match=r"--to 1 2: .*has no platform; .* with AXIS=ANGLE"):
        wanted(bare, "1 2")
