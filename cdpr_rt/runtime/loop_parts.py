"""What a control loop is made of, besides the machine that it runs."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

from cdpr_rt.runtime.estimate import Estimator
from cdpr_rt.runtime.last_lengths import LastLengths
from cdpr_rt.runtime.programs.base import Program
from cdpr_rt.supervisor import Supervisor


@dataclass(frozen=True)
class LoopParts:
    """What the loop runs besides the machine; all made for its n axes."""

    programs: Mapping[str, Program]
    """By name, in the order of their numbers; `idle` and `hold` are among them.

    One that is called `lower` lets a platform down before the power goes.
    """
    supervisor: Supervisor
    estimator: Estimator
    lengths_disagree_m: Callable[[], float] | None = None
    """Returns by how much the cables' lengths contradict each other, where that can be known."""
    lowering_s: float = 0.0
    """The longest that letting a platform down may take."""
    last: LastLengths | None = None
    """Keeps the cables' lengths of the last stop, where a start can make use of them."""
    punctual: Callable[[], Sequence[str]] = tuple
    """Called once before the first paced cycle; returns what was not allowed, for people."""
