"""`cdpr tension`: load cells on a serial line, and the calibration of a winch by tension."""

from __future__ import annotations

import tempfile
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import typer

from cdpr_drivers.bus import BusUrl
from cdpr_drivers.modbus.tension import LoadCells, TensionSampler
from cdpr_profiles import Winch, load_winch
from cdpr_profiles.tension_sensor import TensionSensors, load_load_cells
from cdpr_profiles.winch_calibration import WinchCalibration
from cdpr_rt.core.clock import Clock, PacedClock
from cdpr_tools.commands import options
from cdpr_tools.commands.options import argument, option
from cdpr_tools.commands.with_winch import WinchOnBus, with_winch
from cdpr_tools.commission import tension_calibration
from cdpr_tools.commission import tension_watch as watching
from cdpr_tools.commission.tension_calibration import (
    TOLERANCE,
    AnchorPlan,
    Hang,
    HoistPlan,
    check_masses,
    hoist_tolerance,
    measure_anchored,
    measure_masses,
    plan_anchor,
    plan_hoist,
)
from cdpr_tools.commission.tension_watch import by_prompt, on_board
from cdpr_tools.composition.session import confirm_motion, find_bus, open_winch
from cdpr_tools.errors import BadInputError, WorkFailedError, os_error_as
from cdpr_tools.output import Output
from cdpr_tools.raw_data import keeping_raw_data, refuse_loss
from cdpr_tools.signals import stop_on_signals

app = typer.Typer(name="tension", help="Read, tare and calibrate load cells.", no_args_is_help=True)

_SensorsOption = Annotated[
    str, option("Tension sensors: a name or a file.", "--sensors", metavar="SENSORS")
]
_PortOption = Annotated[
    str, option("Serial port of the RS-485 line, such as /dev/ttyUSB0.", "--tension-port")
]
_FIRST_READING_S = 2.0
_STANDARD_GRAVITY = 9.80665
_MASS_SPEED_mm_s, _ANCHOR_SPEED_mm_s = 40.0, 5.0
_MASS_PLANT = '[load]\nkind = "hung_mass"\n'


@app.command()
def watch(
    sensors: _SensorsOption,
    port: _PortOption,
    seconds: Annotated[float | None, option("Duration; until Ctrl-C by default.", min=0.1)] = None,
    as_json: options.JsonOption = False,
) -> None:
    """Show the tensions live, and their mean and spread at the end; reads only."""
    out = Output(as_json)
    profile, _ = load_load_cells(sensors)
    clock = PacedClock()
    with stop_on_signals() as stop_requested, TensionSampler(profile, port, clock) as sampler:
        figures = watching.watch(sampler, clock, out, seconds or float("inf"), stop_requested)
    for one in figures:
        shown = f"{one['mean_N']:8.2f} N ± {one['std_N']:.2f}, {one['rate_Hz']:.0f} readings/s"
        state = "" if one["valid"] else f"  {one['error'] or one['fault']}"
        out.say(f"{one['cable']:12} {shown if one['readings'] else ''}{state}")
    out.result({"ok": all(one["valid"] for one in figures), "cables": figures})
    if not all(one["valid"] for one in figures):
        raise typer.Exit(WorkFailedError.exit_status)


@app.command()
def tare(
    sensors: _SensorsOption,
    port: _PortOption,
    cable: Annotated[list[str] | None, option("Only this cable; may be repeated.")] = None,
    seconds: Annotated[float, option("Averaging time.", min=0.1, max=60.0)] = 2.0,
    as_json: options.JsonOption = False,
) -> None:
    """Make the present readings zero; every cable must be slack.

    The amplifiers are tared if the profile says how; otherwise the command shows the zeros to write
    into the sensors' file.
    """
    out = Output(as_json)
    profile, amplifier = load_load_cells(sensors)
    chosen = [_number_of(profile, name) for name in cable or [s.cable for s in profile.sensors]]
    clock = PacedClock()
    cells = LoadCells(profile, port, clock)
    try:
        before = _means(cells, chosen, clock, seconds)
        if amplifier.tare is not None:
            for number in chosen:
                cells.tare(number)
            clock.sleep(amplifier.tare.settle_s)
        after = _means(cells, chosen, clock, seconds) if amplifier.tare else before
    finally:
        cells.close()
    tared = []
    for number, was, now in zip(chosen, before, after, strict=True):
        sensor = profile.sensors[number]
        tared.append({"cable": sensor.cable, "before_N": was, "after_N": now})
        if amplifier.tare is not None:
            out.say(f"{sensor.cable:12} {was:8.2f} N  ->  {now:8.2f} N")
        else:
            tared[-1]["zero_N"] = zero = sensor.zero_N + was
            out.say(f'{sensor.cable:12} write zero_N = {zero:.3f} beside cable = "{sensor.cable}"')
    out.result({"ok": True, "cables": tared})


def _means(cells: LoadCells, chosen: list[int], clock: Clock, seconds: float) -> list[float]:
    sums, rounds, until_s = [0.0] * len(chosen), 0, clock.now_s + seconds
    while rounds == 0 or clock.now_s < until_s:
        for i, number in enumerate(chosen):
            reading = cells.read(number)
            if reading.fault:
                raise WorkFailedError(f"{reading.cable}: {reading.fault.label}; not tared")
            sums[i] += reading.tension_N
        rounds += 1
    return [total / rounds for total in sums]


def _number_of(profile: TensionSensors, cable: str | None) -> int:
    names = [sensor.cable for sensor in profile.sensors]
    if cable is None:
        return 0
    if cable not in names:
        raise BadInputError(f"--cable {cable!r}; allowed: {', '.join(names)}")
    return names.index(cable)


@app.command()
@with_winch
def calibrate(
    winch: WinchOnBus,
    out: Output,
    masses: Annotated[
        str | None, option("At least three masses to hang, in kg, such as 2,5,10.")
    ] = None,
    sensors: Annotated[
        str | None, option("Load cells instead of masses: a name or a file.")
    ] = None,
    port: Annotated[
        str | None, option("Serial port of the load cells, such as /dev/ttyUSB0.", "--tension-port")
    ] = None,
    cable: Annotated[str | None, option("The load cell's cable; the first by default.")] = None,
    out_dir: Annotated[
        Path | None, option("Folder for raw data and result; default out/tension-WINCH.", "--out")
    ] = None,
    overwrite: options.OverwriteOption = False,
    speed_mm_s: Annotated[
        float | None,
        option("Cable speed: 40 with masses, 5 without.", "--speed-mm-s", min=0.5, max=200.0),
    ] = None,
    lead_mm: Annotated[
        float, option("Cable to wind in before measuring.", "--lead-mm", min=20.0, max=2000.0)
    ] = 160.0,
    turns: Annotated[int, option("Motor turns to measure in each direction.", min=1, max=20)] = 2,
    gravity: Annotated[float, option("Local gravity, m/s2.", min=9.7, max=9.9)] = _STANDARD_GRAVITY,
    lowest_N: Annotated[float, option("Lowest tension, N.", "--lowest-n")] = 10.0,
    highest_N: Annotated[float, option("Highest tension, N.", "--highest-n")] = 80.0,
    travel_mm: Annotated[
        float,
        option(
            "With a fastened cable: greatest length of cable to wind in.", "--travel-mm", min=1.0
        ),
    ] = 500.0,
    board: Annotated[
        Path | None, option("Physics board of a simulator, which then hangs the masses itself.")
    ] = None,
    safety_io: options.SafetyIoOption = None,
    yes: options.YesOption = False,
) -> None:
    """Identify a winch's tension-to-torque gain and friction, from masses or from a load cell."""
    profile = winch.profile
    run = _Run(winch, out_dir or Path("out") / f"tension-{profile.profile}", safety_io)
    if (masses is None) == (sensors is None):
        raise BadInputError("give either --masses or --sensors")
    if sensors is None and (port is not None or cable is not None):
        raise BadInputError("--tension-port and --cable go with --sensors, not with --masses")
    if board is not None and (sensors is not None or winch.url.starts_own_simulator):
        raise BadInputError("--board goes with --masses on a running simulator (simbus:NAME)")
    if masses is not None:
        kilograms = _masses(masses)
        check_masses(profile, kilograms, gravity)
        speed = speed_mm_s or _MASS_SPEED_mm_s
        hoist = plan_hoist(profile, speed * 1e-3, lead_mm * 1e-3, turns)
        run.prepare(overwrite, yes, "the winch raises and lowers masses")
        run.by_masses(hoist, kilograms, gravity, board)
    else:
        cells, _ = load_load_cells(sensors or "")
        number = _number_of(cells, cable)
        speed = speed_mm_s or _ANCHOR_SPEED_mm_s
        pull = plan_anchor(profile, lowest_N, highest_N, speed * 1e-3, travel_mm * 1e-3)
        if port is None:
            raise BadInputError("--sensors needs --tension-port, the serial port of the load cells")
        # use this cell only: the others may be silent and must not delay it
        cell = cells.model_copy(update={"sensors": (cells.sensors[number],)})
        run.prepare(overwrite, yes, "the winch pulls the fastened cable")
        run.by_load_cell(pull, cell, port)
    _finish(out, run.folder, profile)


@dataclass(frozen=True)
class _Run:
    """One calibration: its winch, its bus and its files."""

    winch: WinchOnBus
    folder: Path
    safety_io: str | None

    def prepare(self, overwrite: bool, yes: bool, what: str) -> None:
        """Prepare the folder for recordings, and ask before a real motor is energised."""
        refuse_loss(self.folder, tension_calibration.raw_folder(self.folder), overwrite)
        confirm_motion(self.winch.url, yes, what)
        with os_error_as(BadInputError, f"--out {self.folder}: cannot be written"):
            tension_calibration.discard(self.folder)
            tension_calibration.raw_folder(self.folder).mkdir(parents=True, exist_ok=True)

    def by_masses(
        self, plan: HoistPlan, masses_kg: list[float], gravity: float, board: Path | None
    ) -> None:
        """Record the raising and lowering of masses."""
        winch, out = self.winch.profile, self.winch.out
        with ExitStack() as stack:
            url, hang = _bus_and_hanging(stack, self.winch, board)
            stack.enter_context(keeping_raw_data(tension_calibration.raw_folder(self.folder)))
            tolerance = hoist_tolerance(plan)
            opened = open_winch(winch, url, out, safety_io=self.safety_io, tolerance=tolerance)
            session = stack.enter_context(opened)
            raw = tension_calibration.raw_folder(self.folder)
            measure_masses(session, out, raw, plan, masses_kg, hang, gravity)

    def by_load_cell(self, plan: AnchorPlan, cell: TensionSensors, port: str) -> None:
        """Record a pull on a fastened cable."""
        at, out = self.winch, self.winch.out
        with ExitStack() as stack:
            stack.enter_context(keeping_raw_data(tension_calibration.raw_folder(self.folder)))
            opened = open_winch(
                at.profile, at.url, out, at.plant, safety_io=self.safety_io, tolerance=TOLERANCE
            )
            session = stack.enter_context(opened)
            sampler = stack.enter_context(TensionSampler(cell, port, session.device.clock))
            session.run_task(lambda: sampler.await_readings(_FIRST_READING_S))
            path = tension_calibration.pull_file(self.folder)
            measure_anchored(session, out, path, plan, sampler.exchange)


@app.command()
def fit(
    folder: Annotated[Path, argument("The --out folder of a tension calibration.")],
    winch: options.RecordedWinchOption = None,
    as_json: options.JsonOption = False,
) -> None:
    """Identify again from the recordings of a tension calibration."""
    out = Output(as_json)
    _finish(out, folder, load_winch(winch or tension_calibration.recorded_winch(folder)))


def _finish(out: Output, folder: Path, winch: Winch) -> None:
    with keeping_raw_data(tension_calibration.raw_folder(folder)):
        found, points = tension_calibration.calibrate(folder, winch)
    path, picture = folder / tension_calibration.FILE_NAME, folder / tension_calibration.PICTURE
    from cdpr_tools.commission.tension_picture import draw_calibration  # noqa: PLC0415  # slow to load

    with os_error_as(WorkFailedError, f"{picture}: cannot be written"):
        draw_calibration(picture, points, found)
    show(out, found, path)
    result = found.model_dump(mode="json")
    out.result({"ok": True, "calibration": str(path), "picture": str(picture), **result})


def _masses(text: str) -> list[float]:
    try:
        return [float(part) for part in text.split(",")]
    except ValueError:
        raise BadInputError(f"--masses {text}: allowed: numbers in kg, such as 2,5,10") from None


def _bus_and_hanging(
    stack: ExitStack, winch: WinchOnBus, board: Path | None
) -> tuple[BusUrl, Hang]:
    """Return the bus and the function that hangs masses; `simbus:` starts a simulator."""
    url, plant = winch.url, winch.plant
    if url.starts_own_simulator:
        place = Path(stack.enter_context(tempfile.TemporaryDirectory(prefix="cdpr-tension-")))
        board = place / "board"
        if plant is None:
            plant = place / "plant.toml"
            plant.write_text(_MASS_PLANT)
    url = find_bus(stack, winch.profile, url, winch.out, plant, board=board)
    return url, by_prompt if board is None else on_board(board)


def show(out: Output, found: WinchCalibration, path: Path) -> None:
    """Print the calibration."""
    gain, half = found.gain_m * 1e3, found.gain_half_width_m * 1e3
    apart = 100.0 * (found.gain_m / found.nominal_gain_m - 1.0)
    out.say(f"gain K_t         {gain:.3f} ± {half:.3f} mNm/N ({apart:+.1f} % from the geometry)")
    out.say(
        f"friction         {found.friction_Nm:.3f} ± {found.friction_half_width_Nm:.3f} Nm, and "
        f"{found.friction_per_N_m * 1e3:.2f} ± {found.friction_per_N_half_width_m * 1e3:.2f} mNm/N"
    )
    top = found.highest_tension_N
    share = 100.0 * found.friction_at_Nm(top) / found.torque_Nm(top)
    out.say(f"                 {share:.1f} % of the torque at {top:.0f} N")
    out.say(f"bias             {found.bias_Nm:+.3f} ± {found.bias_half_width_Nm:.3f} Nm")
    out.say(f"residual         {found.residual_rms_Nm * 1e3:.1f} mNm rms")
    out.say(f"calibration      {path}")
