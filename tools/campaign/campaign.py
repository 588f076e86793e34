"""Run a campaign, shrink a failing scenario, and show the outcomes as a table."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from typing import Final

from cdpr_profiles import load_robot
from cdpr_profiles.platform import NO_PLATFORM
from cdpr_rt.diagnosis.checks import refuse_impossible
from cdpr_tools.campaign.farm import DID_NOT_START, Seeds
from cdpr_tools.campaign.judge import Result
from cdpr_tools.campaign.scenario import Scenario, draw
from cdpr_tools.errors import BadInputError, WorkFailedError
from cdpr_tools.processes import cores, runner

_SEEDS_A_JOB: Final = 40
_EVERY: Final = 20
"""Of this number of seeds, one runs twice."""


def drawn(seeds: Sequence[int], robots: Sequence[str]) -> list[Scenario]:
    """Return the scenarios of seeds; raises ProfileError, BadInputError for unsuitable robots."""
    loaded = [(name, load_robot(name)) for name in robots]
    for name, robot in loaded:
        if robot.platform is None or robot.tension_sensors is not None:
            why = NO_PLATFORM if robot.platform is None else "has load cells"
            raise BadInputError(
                f"{name}: {why}; allowed: robots with a platform, without load cells"
            )
        refuse_impossible(robot)
    return [draw(seed, loaded) for seed in seeds]


def run(
    scenarios: Sequence[Scenario],
    workers: int | None,
    cluster: str | None,
    advance: Callable[[float], None],
) -> list[Result]:
    """Return the results in the order of the scenarios; `advance` receives the share done.

    Some seeds run twice, each from a separate start, and must give the same bytes.
    """
    jobs = list(_jobs(scenarios))
    repeated = list(_jobs(scenarios[::_EVERY])) * (len(scenarios) > 1)
    found: list[Result] = []
    with runner(min(workers or cores(), len(jobs)), cluster) as run_jobs:
        for done, results in enumerate(run_jobs([*jobs, *repeated]), start=1):
            found += results
            advance(done / (len(jobs) + len(repeated)))
    by_seed: dict[int, Result] = {}
    for result in found:
        first = by_seed.setdefault(result.seed, result)
        if first.digest != result.digest:
            first.violations.append(f"same_bytes: {first.digest}, then {result.digest}")
    return [by_seed[one.seed] for one in scenarios]


def _jobs(scenarios: Sequence[Scenario]) -> Iterator[Seeds]:
    """Yield groups of scenarios with the same robot and plant."""
    groups: dict[str, list[Scenario]] = {}
    for one in scenarios:
        groups.setdefault(f"{one.robot} {one.plant}", []).append(one)
    for group in groups.values():
        for first in range(0, len(group), _SEEDS_A_JOB):
            yield Seeds(tuple(group[first : first + _SEEDS_A_JOB]))


# Shrinking.


def shrunk(scenario: Scenario, note: Callable[[str], None]) -> Scenario:
    """Return the smallest scenario found that violates the same invariant as this one.

    Raises WorkFailedError if it violates none.
    """
    (found,) = _violated([scenario])
    if not found:
        raise WorkFailedError(
            f"seed {scenario.seed}: nothing to shrink: the scenario violates nothing"
        )
    wanted = found[0]
    note(f"{wanted}: {len(scenario.actions)} actions, {len(scenario.faults)} faults")
    scenario = _first_failing(
        [replace(scenario, recorded=False, recovers=False), scenario], wanted
    ) or scenario  # fmt: skip
    while True:
        parts = list(_parts(scenario))
        loose = [
            part
            for part, names in zip(
                parts, _violated([_without(scenario, [part]) for part in parts]), strict=True
            )
            if wanted in names
        ]
        candidates = [_without(scenario, loose[:k]) for k in range(len(loose), 0, -1)]
        smaller = _first_failing(candidates, wanted)
        if smaller is None:
            return scenario
        scenario = smaller
        note(f"{len(scenario.actions)} actions, {len(scenario.faults)} faults")


_Part = tuple[str, int]


def _parts(scenario: Scenario) -> Iterator[_Part]:
    for i, action in enumerate(scenario.actions):
        yield ("wait" if action["do"] == "wait" else "action"), i
    for i in range(len(scenario.faults)):
        yield "fault", i


def _without(scenario: Scenario, parts: Sequence[_Part]) -> Scenario:
    """Return the scenario without these parts; a wait of the same length replaces an action."""
    actions = [
        {"do": "wait", "wait_s": action["wait_s"]} if ("action", i) in parts else action
        for i, action in enumerate(scenario.actions)
        if ("wait", i) not in parts
    ]
    faults = [one for i, one in enumerate(scenario.faults) if ("fault", i) not in parts]
    return replace(scenario, actions=tuple(actions), faults=tuple(faults))


def _violated(scenarios: Sequence[Scenario]) -> list[list[str]]:
    """Return the names of the invariants that each scenario violates."""
    if not scenarios:
        return []
    return [
        [violation.partition(":")[0] for violation in result.violations]
        for result in Seeds(tuple(scenarios)).run()
    ]


def _first_failing(scenarios: Sequence[Scenario], wanted: str) -> Scenario | None:
    for scenario, names in zip(scenarios, _violated(scenarios), strict=True):
        if wanted in names:
            return scenario
    return None


# Figures.


def table(results: Sequence[Result]) -> list[str]:
    """Return the table of faults by outcome, as lines."""
    counts = Counter(pair for result in results for pair in result.faults)
    outcomes = sorted({outcome for _, outcome in counts})
    faults = sorted({fault for fault, _ in counts})
    wide = max([len("fault"), *map(len, faults)])
    lines = ["  ".join(["fault".ljust(wide), *outcomes])]
    for fault in faults:
        cells = [str(counts[fault, one] or "-").rjust(len(one)) for one in outcomes]
        lines.append("  ".join([fault.ljust(wide), *cells]))
    return lines


def summary(results: Sequence[Result]) -> list[str]:
    """Return which robots did not start, the number of failing seeds, and the pace, as lines."""
    unstarted = Counter(
        f"{result.robot} {note}"
        for result in results
        for note in result.notes
        if note.startswith(DID_NOT_START)
    )
    failing = sum(bool(result.violations) for result in results)
    cpu_s = sum(result.cpu_s for result in results)
    pace = f", {3600.0 * len(results) / cpu_s:.0f} per hour and core" if cpu_s else ""
    return [
        *(f"{count} seeds: {text}" for text, count in unstarted.items()),
        f"{len(results)} seeds, {failing} failing{pace}",
    ]
