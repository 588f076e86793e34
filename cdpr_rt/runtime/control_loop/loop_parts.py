"""The parts of a control loop, besides the machine that it runs."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

from cdpr_rt.core.estimate import Estimator
from cdpr_rt.core.supervision.supervisor import Supervisor
from cdpr_rt.programs.base import Program
from cdpr_rt.programs.platform.paths.path_store import PathStore
from cdpr_rt.robots.persistence.last_lengths import LastLengths


@dataclass(frozen=True)
class Lowering:
    """Lowering of a platform before power-off, where no brakes would hold it."""

    program: str
    """Name of the program; `{"blind": true}` has it lower without a pose."""
    longest_s: float
    """The longest that it may take."""


@dataclass(frozen=True)
class LoopParts:
    """The parts of a control loop, all made for the n axes of its machine."""

    programs: Mapping[str, Program]
    """By name, in the order of their numbers; `idle` and `hold` are among them."""
    supervisor: Supervisor
    estimator: Estimator
    lengths_disagree: Callable[[], tuple[float, int]] | None = None
    """Returns the largest normalised residual of cable lengths, m, and its cable, or -1."""
    lowering: Lowering | None = None
    """Lowering of the platform, None for a robot without such a program."""
    last_stop: LastLengths | None = None
    """Stores the cables' lengths of the last stop, where a start can use them."""
    paths: PathStore | None = None
    """The planned paths of a robot with a platform."""
    notices: Callable[[], Sequence[str]] = tuple
    """Returns notices to the operator, besides the state."""
    before_power: Callable[[], object] = lambda: None
    """Called before the drives get power; may wait for files."""
    enable_realtime: Callable[[], Sequence[str]] = tuple
    """Called once before the first paced cycle; returns notices of what was not permitted."""
