"""Scenarios: what users do with a robot and which faults happen, as data drawn from a seed."""

from __future__ import annotations

import json
import math
import random
from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, Final, Self

from cdpr_profiles import Robot
from cdpr_profiles.bounded_input import parse_json
from cdpr_profiles.errors import ProfileError
from cdpr_sim_bus.cia402.faults import FAULTS
from cdpr_tools.errors import BadInputError

BEFORE_BOOT, READY, TIGHT = "before boot", "ready", "tight"
"""States of the robot when a scenario begins."""

Action = dict[str, Any]
"""What a user does: `do`, its arguments, and `wait_s`, the bus time until the next action."""

_SEEDS_A_PLANT: Final = 100
_RECOVERED, _RECORDED, _DYING = 0.2, 0.1, 0.08
_CLOSE_S: Final = 0.05
_IN_TRANSITION: Final = 0.3
_TRANSITIONS: Final = ("enable", "tighten", "lower", "disable", "stop")


@dataclass(frozen=True)
class Scenario:
    """One scenario: a robot, its plant, the actions of its users and its faults."""

    seed: int
    robot: str
    plant: dict[str, Any]
    """Content of the simulator's plant file."""
    start: str
    actions: tuple[Action, ...]
    faults: tuple[dict[str, Any], ...]
    """Orders of the simulator: `fault`, `axis` from 1, `value`, and `at_s` since the beginning.

    The value 0 ends a fault.
    """
    recovers: bool
    """Whether the faults are repaired at the end, and the robot must work again."""
    recorded: bool

    @classmethod
    def load(cls, file: Path) -> Self:
        """Read a script; raises BadInputError."""
        try:
            given = parse_json(file.read_bytes(), str(file))
            return cls(
                **given
                | {"actions": tuple(given["actions"]), "faults": tuple(given.get("faults", ()))}
            )
        except (OSError, ProfileError, TypeError, KeyError) as error:
            raise BadInputError(f"{file}: not a script of a campaign: {error}") from None

    def text(self) -> str:
        """Return the script, as `load` reads it."""
        return json.dumps(asdict(self), indent=1)

    def plant_text(self) -> str:
        """Return the plant file."""
        tables = {key: value for key, value in self.plant.items() if isinstance(value, dict)}
        lines = [f"{key} = {json.dumps(value)}" for key, value in self.plant.items()
                 if key not in tables]  # fmt: skip
        for table, values in tables.items():
            lines += [f"[{table}]", *(f"{key} = {json.dumps(v)}" for key, v in values.items())]
        return "\n".join([*lines, ""])


def draw(seed: int, robots: Sequence[tuple[str, Robot]]) -> Scenario:
    """Return the scenario of a seed for one of these robots, each with its name or file."""
    rng = random.Random(f"campaign {seed}")
    name, robot = rng.choice(robots)
    start = rng.choices((TIGHT, READY, BEFORE_BOOT), (0.67, 0.25, 0.08))[0]
    actions = [_action(rng, robot) for _ in range(rng.randint(3, 8))]
    if start != TIGHT:
        actions[:0] = [
            {"do": "enable", "wait_s": _round(rng.uniform(0.005, 0.3))},
            {"do": "tighten", "wait_s": _round(rng.choice((0.5, 2.0, 6.0, 12.0)) * rng.random())},
        ]
    if rng.random() < _DYING:
        actions.append({"do": "die", "wait_s": 0.0})
    begun_s = _beginnings(actions)
    at_s = sorted(rng.uniform(0.0, begun_s[-1] + 0.3) for _ in range(rng.randint(1, 3)))
    if start == BEFORE_BOOT and rng.random() < 0.7:
        at_s[0] = rng.uniform(0.0, 0.3)
    elif rng.random() < _IN_TRANSITION:  # while it is enabled, tightened, lowered or stopped
        changes = [i for i, action in enumerate(actions) if action["do"] in _TRANSITIONS]
        at_s[0] = begun_s[rng.choice(changes)] + rng.uniform(0.0, 0.5) if changes else at_s[0]
    if len(at_s) > 1 and rng.random() < 0.4:
        at_s[1] = at_s[0] + rng.uniform(0.0, _CLOSE_S)
    planar = robot.platform is not None and robot.platform.is_planar
    kinds = [name for name in DRAWN if not (planar and FAULTS[name].needs == "space")]
    return Scenario(
        seed, name, _plant(seed // _SEEDS_A_PLANT, robot), start, tuple(actions),
        tuple(fault for one in at_s for fault in _faults(rng, rng.choice(kinds), robot, one)),
        rng.random() < _RECOVERED, rng.random() < _RECORDED,
    )  # fmt: skip


def _beginnings(actions: Sequence[Action]) -> list[float]:
    """Return when each action begins, and when the last one is over, since the beginning."""
    times_s = [0.0]
    for action in actions:
        times_s.append(times_s[-1] + action.get("seconds", 0.0) + action["wait_s"])
    return times_s


def _plant(number: int, robot: Robot) -> dict[str, Any]:
    """Return deviations of a machine from its profile, as builders may make them."""
    rng = random.Random(f"plant {number} {robot.name}")
    return {
        "seed": rng.randrange(2**31),
        "platform": {"mass_error": _round(rng.uniform(-0.1, 0.1))},
        "geometry": {"exit_sigma_m": _round(rng.uniform(0.0, 0.001))},
        "cables": {
            "stiffness_error": _round(rng.uniform(-0.2, 0.2)),
            "friction_share": _round(rng.uniform(0.0, 0.04)),
        },
        "start": {"slack_m": _round(rng.uniform(0.005, 0.04))},
    }


def _round(value: float) -> float:
    return round(value, 4)


# What users do.


def _action(rng: random.Random, robot: Robot) -> Action:
    name = rng.choices(tuple(_ACTIONS), tuple(_ACTIONS.values()))[0]
    action: Action = {"do": name, **_arguments(rng, robot, name)}
    # most actions follow before the last one is done
    action["wait_s"] = _round(rng.choice((0.02, 0.3, 1.2)) * rng.random())
    return action


_ACTIONS: Final = {
    "move": 30, "stream": 8, "path": 3, "jog": 4, "hold": 10, "resume": 8, "disable": 5,
    "enable": 6, "acknowledge": 5, "lower": 7, "tighten": 8, "stop": 4, "power off": 2,
    "stall": 3, "leave": 3, "return": 4,
}  # fmt: skip
"""Actions and how often they are drawn."""


def _arguments(rng: random.Random, robot: Robot, name: str) -> dict[str, Any]:
    platform = robot.platform
    assert platform is not None  # campaigns are for robots with a platform
    if name == "jog":
        return {"velocity_rad_s": [_round(rng.uniform(-2.0, 2.0)) for _ in robot.axes],
                "duration_s": _round(rng.uniform(0.1, 1.0))}  # fmt: skip
    if name == "stall":
        return {"seconds": _round(math.exp(rng.uniform(math.log(0.003), math.log(1.0))))}
    if name not in ("move", "stream", "path"):
        return {}
    low, high = platform.workspace_min_m, platform.workspace_max_m
    reach = 1.15 if rng.random() < 0.3 else 0.9  # of the box; some places are beyond it
    places = [
        [_round(0.5 * (a + b) + reach * 0.5 * (b - a) * rng.uniform(-1.0, 1.0))
         for a, b in zip(low, high, strict=True)]
        for _ in range(3)
    ]  # fmt: skip
    if name == "path":
        return {"points_m": places}
    if name == "stream":
        return {"to_m": places[0], "seconds": _round(rng.uniform(0.2, 1.2)),
                "loss": rng.choice((0.0, 0.2, 0.9))}  # fmt: skip
    given: dict[str, Any] = {"position_m": places[0]}
    turns = len(platform.controlled) - len(low)
    if turns > 0 and rng.random() < 0.3:
        given["rotation_rad"] = [
            _round(1.2 * platform.workspace_angle_rad * rng.uniform(-1.0, 1.0))
            for _ in range(turns)
        ]
    if rng.random() < 0.3:
        given["speed_m_s"] = _round(platform.speed_m_s * rng.uniform(0.05, 1.1))
    return given


# What breaks.


def _faults(rng: random.Random, name: str, robot: Robot, at_s: float) -> Iterator[dict[str, Any]]:
    value: float | None = None
    if values := _RANGES.get(name):
        value = rng.randint(*values) if isinstance(values[0], int) else rng.uniform(*values)
        if name in _A_KILOGRAM and robot.platform is not None:
            value *= robot.platform.mass_kg
        value = _round(value)
    fault = {"fault": name, "axis": rng.randint(1, len(robot.axes)), "value": value}
    yield fault | {"at_s": _round(at_s)}
    if name.startswith("push"):
        yield fault | {"value": 0, "at_s": _round(at_s + rng.uniform(0.1, 0.6))}


_A_KILOGRAM: Final = ("push-x", "push-y", "push-z", "payload")
"""Faults whose values are drawn per kilogram of the platform."""
_RANGES: Final[dict[str, tuple[Any, Any]]] = {
    "torque-bias": (-1.0, 1.0), "torque-limit": (0.05, 2.0),
    "encoder-jump": (-4000, 4000), "encoder-noise": (1.0, 200.0),
    "silence": (1, 400), "frames-lost": (1, 8), "frames-lossy": (1.0, 60.0),
    "frames-doubled": (1, 60), "frames-late": (1, 8), "frames-corrupted": (1, 4),
    "heartbeat-late": (50, 1000), "emcy": (0x1000, 0xFFFF), "emcy-flood": (1, 12),
    "slip": (5, 300), "push-x": (-5.0, 5.0), "push-y": (-5.0, 5.0), "push-z": (-5.0, 5.0),
    "obstacle": (1.0, 200.0), "payload": (0.05, 1.0),
}  # fmt: skip
"""Ranges of drawn values; other faults have their usual values."""
_NOT_DRAWN: Final = ("cell-off", "brake-worn", "brake-stuck", "put-back")
DRAWN: Final = tuple(
    name for name, fault in FAULTS.items() if fault.needs != "board" and name not in _NOT_DRAWN
)
"""Faults that are drawn: all except those of load cells, brakes and safety I/O, which these robots
lack."""
