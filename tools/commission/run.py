"""Commission the motor of one winch, for the command and for `cdpr_rt.commission`."""

from __future__ import annotations

import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from cdpr_drivers.bus import BusUrl
from cdpr_profiles import Winch, load_winch
from cdpr_rt.identification.commissioning_results import Paths, assemble, identify
from cdpr_rt.robot import Error, InvalidArgument, number_in, path_of
from cdpr_tools.client.handle_errors import errors_for_scripts
from cdpr_tools.commission import summary
from cdpr_tools.commission.commissioning import (
    DEFAULT_BANDWIDTH_HZ,
    QUICK,
    THOROUGH,
    Commissioning,
    Index,
    Plan,
)
from cdpr_tools.composition.session import open_bus, open_winch
from cdpr_tools.errors import BadInputError, WorkFailedError, os_error_as
from cdpr_tools.output import Output, to_json
from cdpr_tools.raw_data import discard_raw_data, keeping_raw_data, refuse_loss
from cdpr_tools.recordings.truth import true_angle


@dataclass(frozen=True)
class Request:
    """How a motor is commissioned."""

    plan: Plan
    bandwidth_Hz: float
    index: Index
    safety_io: str | None


def commission_winch(
    winch: Winch,
    url: BusUrl,
    paths: Paths,
    request: Request,
    out: Output,
    plant: Path | None = None,
) -> dict[str, Any]:
    """Commission the motor of `winch`; return the results for the report."""
    with keeping_raw_data(paths.raw_folder):
        with open_winch(winch, url, out, plant, paths.truth, request.safety_io) as session:
            run = Commissioning(session, out, paths, request.plan).run(
                request.bandwidth_Hz, request.index
            )
        write(paths.run, to_json(run, indent=1))
        found = identify(winch, run["latency_s"], paths)
        results = assemble(paths, run, found, true_angle(paths.truth))
        # imported here, to save memory while the motor turns and while it is identified
        from cdpr_tools.commission import page  # noqa: PLC0415

        page.build(paths, winch, results, found)
    summary.show(out, results)
    return results


def prepare(folder: Path, overwrite: bool) -> Paths:
    """Return the paths in `folder`; raises BadInputError if an earlier run would be lost."""
    paths = Paths(folder)
    raw = paths.raw_folder
    refuse_loss(folder, raw, overwrite)
    if folder.is_dir() and any(folder.iterdir()) and not raw.is_dir() and not overwrite:
        raise BadInputError(
            f"--out {folder}: contains other files; choose a new folder, or write the "
            "results there with --overwrite"
        )
    with os_error_as(BadInputError, f"--out {folder}: cannot be written"):
        if discard_raw_data(raw):
            for path in (paths.run, paths.results, paths.page, paths.profile, paths.truth):
                path.unlink(missing_ok=True)
        raw.mkdir(parents=True, exist_ok=True)
    return paths


def write(path: Path, text: str) -> None:
    """Write a small file; raises WorkFailedError that names it."""
    with os_error_as(WorkFailedError, f"{path}: cannot be written"):
        path.write_text(text + "\n", encoding="utf-8")


def commission(
    winch: str | Path,
    *,
    bus: str,
    folder: str | Path | None = None,
    plant: str | Path | None = None,
    bandwidth_Hz: float = DEFAULT_BANDWIDTH_HZ,
    quick: bool = False,
    index: Index = "homing",
    safety_io: str | None = None,
    overwrite: bool = False,
    yes: bool = False,
) -> dict[str, Any]:
    """Commission the motor of a winch, detached from its load, as `cdpr commission` does.

    Return what that command prints with `--json`, such as `result["identification"]`,
    `result["validation"]` and `result["files"]`. Values are in SI units unless a key names another
    unit. `winch` is the name or file of a winch. `bus` is a URL, such as "simbus:" for a simulated
    motor, which deviates from its profile as the file `plant` says. Raw data, profile and report go
    into `folder`, by default out/commission-NAME. `quick` takes a fifth of the time and gives a
    rough result. `index` is "homing" or "probe". A real bus needs `yes`. Progress goes to standard
    error. The motor has no power when the call ends. Ctrl-C stops it under control and raises
    KeyboardInterrupt. Raises InvalidRobot for the winch's file, InvalidArgument, Faulted if a drive
    or a limit ends the motion, and Error. Call it from the main thread.
    """
    with errors_for_scripts({"--overwrite": "overwrite=True", "--out": "folder"}):
        for name, text in (("bus", bus), ("index", index), ("safety_io", safety_io)):
            if not isinstance(text, str) and (text is not None or name != "safety_io"):
                raise InvalidArgument(f"{name}: {text!r}; allowed: a text")
        if index not in ("homing", "probe"):
            raise InvalidArgument(f"index: {index!r}; allowed: 'homing', 'probe'")
        bandwidth_Hz = number_in("bandwidth_Hz", bandwidth_Hz, 1.0, 100.0)
        profile, url = load_winch(winch), open_bus(bus)
        if not (url.is_simulated or yes):
            raise InvalidArgument(f"yes: False; the real motor on {url} will turn; give yes=True")
        usual = f"out/commission-{profile.profile}"
        out = path_of("folder", usual if folder is None else folder)
        request = Request(QUICK if quick else THOROUGH, bandwidth_Hz, index, safety_io)
        plant_file = None if plant is None else path_of("plant", plant)
        paths = prepare(out, overwrite)
        with _ctrl_c_kept():
            return commission_winch(profile, url, paths, request, Output(as_json=True), plant_file)


@contextmanager
def _ctrl_c_kept() -> Iterator[None]:
    """Restore the effect of Ctrl-C after the block, because a session ignores all but the first."""
    if threading.current_thread() is not threading.main_thread():
        raise Error("commission: call it from the main thread, because Ctrl-C stops the motor")
    before = signal.getsignal(signal.SIGINT)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, before)
