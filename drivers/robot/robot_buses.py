"""Map each bus of a robot to a real or simulated bus, from the file and the command line."""

from __future__ import annotations

import re
from collections.abc import Sequence

from cdpr_drivers.bus.budget import BusBudget, machine_budget
from cdpr_drivers.bus.url import BusUrl
from cdpr_drivers.errors import BusError, ConfigurationError
from cdpr_profiles import Robot, Winch

_ASSIGNMENT = re.compile(r"(?P<bus>[A-Za-z0-9_-]+)=(?P<url>.+)", re.DOTALL)


def simulated_url(name: str, bus: str) -> str:
    """Return the URL of a robot's bus on the simulator `name`."""
    return f"simbus:{name}-{bus}"


def starts_own_simulator(texts: Sequence[str]) -> bool:
    """Whether the command must start its own simulator."""
    return list(texts) == ["simbus:"]


def robot_urls(robot: Robot, texts: Sequence[str]) -> dict[str, BusUrl]:
    """Return the URL of each bus of `robot`, by its name there.

    `texts` are the values of --bus: `simbus:NAME`, which stands for simbus:NAME-BUS on every bus,
    or BUS=URL for some buses. The others keep the URL of the robot's file. Raises
    ConfigurationError.
    """
    names = [bus.name for bus in robot.buses]
    given = _given(robot, names, texts)
    urls: dict[str, BusUrl] = {}
    for bus in robot.buses:
        text = given.get(bus.name, bus.url)
        if text is None:
            raise ConfigurationError(
                f"{robot.path}: bus {bus.name!r} has no url; add it there or give "
                f"--bus {bus.name}=URL, or --bus simbus:NAME for a simulated robot"
            )
        url = _parse(text)
        if url.starts_own_simulator:
            raise ConfigurationError(
                f"--bus {bus.name}={text}: a single bus needs a name (simbus:NAME); `simbus:` "
                "alone starts a simulator for all buses"
            )
        same = next((name for name, other in urls.items() if other == url), None)
        if same is not None:
            raise ConfigurationError(
                f"buses {same!r} and {bus.name!r}: both are {url}; give each URL once"
            )
        urls[bus.name] = url
    return urls


def real_buses(robot: Robot, texts: Sequence[str]) -> list[str]:
    """Return the URLs of the real buses. Raises ConfigurationError as `robot_urls` does."""
    if starts_own_simulator(texts):
        return []
    return [str(url) for url in robot_urls(robot, texts).values() if not url.is_simulated]


def refuse_simulated_calibration(robot: Robot, texts: Sequence[str]) -> None:
    """Raise ConfigurationError if a calibration of a simulated robot would move a real one."""
    known = robot.calibration
    if known is None or not known.simulated:
        return
    if real := real_buses(robot, texts):
        raise ConfigurationError(
            f"{robot.path}: calibration {known.version} was measured on a simulated robot; "
            f"allowed: simbus, not {' and '.join(real)}; to undo it: cdpr calibrate undo "
            f"{robot.reference}"
        )


def _given(robot: Robot, names: list[str], texts: Sequence[str]) -> dict[str, str]:
    given: dict[str, str] = {}
    for text in texts:
        match = _ASSIGNMENT.fullmatch(text)
        if match is None:
            if len(texts) > 1:
                raise ConfigurationError(
                    f"--bus {text}: write several buses as BUS=URL, one for each bus"
                )
            return _for_all(robot, names, text)
        bus = match["bus"]
        if bus not in names:
            raise ConfigurationError(f"--bus {text}: no bus {bus!r}; allowed: {', '.join(names)}")
        if bus in given:
            raise ConfigurationError(f"--bus {text}: {bus!r} is already given as {given[bus]}")
        given[bus] = match["url"]
    return given


def _for_all(robot: Robot, names: list[str], text: str) -> dict[str, str]:
    url = _parse(text)
    if url.interface == "simbus" and url.channel and not robot.is_winch:
        return {name: simulated_url(url.channel, name) for name in names}
    if len(names) == 1:
        return {names[0]: text}
    each = " ".join(f"--bus {name}=URL" for name in names)
    raise ConfigurationError(
        f"--bus {text}: {robot.name} has {len(names)} buses; write {each}, or --bus simbus:NAME "
        "for simulated ones"
    )


def _parse(text: str) -> BusUrl:
    try:
        return BusUrl.parse(text)
    except BusError as error:
        raise ConfigurationError(str(error)) from error


# Reject a machine whose cycle cannot fit its buses, before anything is opened.


def refusal(budgets: Sequence[BusBudget]) -> str:
    """Return why the cycle does not fit its buses; empty if it does."""
    tight = [str(budget) for budget in budgets if not budget.fits]
    return "the cycle does not fit: " + "; ".join(tight) if tight else ""


def require_fit(machine: Winch | Robot) -> None:
    """Raise ConfigurationError with the figure if a bus of `machine` cannot carry its cycle."""
    reason = refusal(machine_budget(machine))
    if reason:
        raise ConfigurationError(
            f"{machine.path}: sync_period_s: {machine.sync_period_s:g}: {reason}; "
            "`cdpr bus budget` shows the details"
        )
