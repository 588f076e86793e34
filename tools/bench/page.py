"""Measure the operator's page in a real Chromium: its stop, its start, its cost, its memory.

Run as a program, it keeps connections open that behave like further pages; its arguments are the
address, their number, and how many of them never read.
"""

from __future__ import annotations

import asyncio
import os
import shutil
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import ExitStack, closing, contextmanager, suppress
from pathlib import Path
from subprocess import PIPE, Popen
from typing import TYPE_CHECKING, Any, Final

import httpx
import numpy as np
from websockets.asyncio.client import connect
from websockets.exceptions import ConnectionClosed

from cdpr_profiles import Robot, load_robot
from cdpr_tools.bench import baseline_loop
from cdpr_tools.bench.harness import Figures, Row, Target, percentiles
from cdpr_tools.bench.loop import motion, processor_time_s, with_tolerant_limits
from cdpr_tools.client.client import Daemon, open_daemon
from cdpr_tools.client.daemon_robot import run
from cdpr_tools.daemon.paths import default_socket
from cdpr_tools.errors import BadInputError, WorkFailedError
from cdpr_tools.output import Output
from cdpr_tools.processes import module_command

if TYPE_CHECKING:
    from playwright.sync_api import Browser, Page

RATE_Hz: Final = 30
_FIELDS: Final = "time_s,tension_N,tension_measured,pose,pose_setpoint"
_STOP_ROBOT, _ROBOT = "bench-2", "bench-8"
_OTHERS, _MANY, _SLOW = 19, 49, 5
_SPEED_rad_s, _TURNS_S, _BRAKES_S = 6.0, 0.15, 0.2
_PATIENCE_S, _LOOK_S = 60.0, 0.02
_OPENINGS, _ROUNDS = 10, 3
_BATCH = 30 * 900
_NO_GRAPHICS: Final = ("--no-sandbox", "--disable-3d-apis")
"""Without a graphics processor, the three-dimensional picture would be measured, not the page."""
_IN_PAGE: Final = """
addEventListener("pointerdown", ({ timeStamp }) => {
  globalThis.__press = performance.timeOrigin + timeStamp;
}, true);
globalThis.__cycles = 0;
globalThis.__last = {};
const Real = WebSocket;
globalThis.WebSocket = class extends Real {
  constructor(...given) {
    super(...given);
    if (!String(given[0]).includes("/live")) return;
    globalThis.__live = this;
    this.addEventListener("message", ({ data }) => {
      const message = JSON.parse(data);
      __cycles += message.kind === "cycle";
      __last[message.kind] = message;
    });
  }
};
new MutationObserver((_, watching) => {
  if (!document.querySelector(".tensions li")) return;
  watching.disconnect();
  requestAnimationFrame(() => setTimeout(() => { globalThis.__painted = performance.now() }));
}).observe(document, { childList: true, subtree: true });
"""
_REPLAY: Final = """
async ([begin, count]) => {
  globalThis.__feed ??= __live.onmessage;
  __live.onmessage = null;
  const send = (message) => __feed({ data: JSON.stringify(message) });
  globalThis.__time ??= __last.cycle.time_s;
  for (let number = begin; number < begin + count; number++) {
    __time += 1 / 30;
    send({ ...__last.cycle, time_s: __time });
    if (number % 30 === 0) send(__last.status);
    if (number % 900 === 0) {
      const about = { kind: "command", text: "hold by bench", times: 1, detail: {} };
      const event = { ...about, number: 1e6 + number, time: "2026-01-01T00:00:00Z" };
      send({ kind: "event", event });
    }
    if (number % 300 === 0) await new Promise((resume) => setTimeout(resume));
  }
}
"""


@contextmanager
def _chromium() -> Iterator[Browser]:
    found = shutil.which("chromium") or shutil.which("chromium-browser")
    try:
        # only developers have it
        from playwright.sync_api import Error as PlaywrightError  # noqa: PLC0415
        from playwright.sync_api import sync_playwright  # noqa: PLC0415
    except ModuleNotFoundError:
        found = None
    if found is None:
        raise BadInputError("needs Chromium (package chromium) and `pip install playwright`")
    try:
        with (
            sync_playwright() as api,
            closing(api.chromium.launch(executable_path=found, args=[*_NO_GRAPHICS])) as browser,
        ):
            yield browser
    except PlaywrightError as error:
        why = error.message.partition("\n")[0]
        raise WorkFailedError(f"Chromium: {why} Is the machine busy with other work?") from None


def _opened(browser: Browser, url: str) -> Page:
    context = browser.new_context(viewport={"width": 1400, "height": 900})
    page = context.new_page()
    page.add_init_script(_IN_PAGE)
    page.goto(url)
    end_s = time.monotonic() + _PATIENCE_S
    while not page.evaluate("globalThis.__painted > 0 && __cycles > 0"):
        if time.monotonic() > end_s:
            raise WorkFailedError("the page shows no robot")
        time.sleep(_LOOK_S)
    return page


@contextmanager
def _robot(name: str) -> Iterator[tuple[Robot, Any, Daemon, str]]:
    """Run a daemon on a separate simulator; yield also the page's address."""
    with ExitStack() as stack:
        folder = Path(stack.enter_context(tempfile.TemporaryDirectory(prefix="cdpr-bench-")))
        robot = with_tolerant_limits(load_robot(name), folder)
        bus = stack.enter_context(baseline_loop.simulator(robot))
        handle = stack.enter_context(run(robot.path, bus=bus, record=folder / "recordings"))
        daemon = stack.enter_context(open_daemon(None, default_socket(robot.profile), None, None))
        yield robot, handle, daemon, str(daemon.get("/page-address")["url"])


@contextmanager
def _others(url: str, pages: int, slow: int = 0) -> Iterator[None]:
    """Keep connections open that behave like pages; `slow` of them do not read."""
    command = module_command("cdpr_tools.bench.page", url, str(pages), str(slow))
    with Popen(command, stdin=PIPE, stdout=PIPE, text=True) as process:
        assert process.stdin is not None and process.stdout is not None  # opened with PIPE
        if pages and process.stdout.readline() != "open\n":
            raise WorkFailedError(f"{pages} connections could not be opened")
        yield
        process.stdin.close()


# The stop: from the press in the page to the drives' answers on the bus.


def press_stops(count: int, out: Output) -> Figures:
    """Press the page's stop button while the motors turn, with one page and with 20.

    Each figure is the time from the press event in Chromium until all drives have answered the
    first braking command on the bus. They answer one cycle after it was sent.
    """
    pressed: dict[str, list[float]] = {}
    with (
        _chromium() as browser,
        _robot(_STOP_ROBOT) as (robot, handle, daemon, url),
        out.progress("presses", 2.0 * count) as advance,
    ):
        page = _opened(browser, url)
        with daemon.control() as token:
            daemon.post("/enable", {"program": "hold", "wanted": {}}, token)
        turn = {"velocity_rad_s": [_SPEED_rad_s] * len(robot.axes), "timeout_s": 2.0}
        for number, others in enumerate((0, _OTHERS)):
            times_s = pressed[f"{others + 1} page{'s' * bool(others)}"] = []
            with _others(url, others):
                for k in range(count):
                    with daemon.control() as token:
                        daemon.post("/program", {"program": "jog", "wanted": turn}, token)
                        time.sleep(_TURNS_S)
                        times_s.append(_press(page))
                    advance(float(number * count + k + 1))
        log = handle.log()
    ms = {case: [_answered_ms(log, one) for one in times_s] for case, times_s in pressed.items()}
    rows: dict[str, Row] = {
        case: percentiles(of, 50.0, 99.0, 100.0, digits=1) for case, of in ms.items()
    }
    targets = {
        case.replace(" ", "_"): Target(f"{case}, p99, ms", row["p99"], 100.0)
        for case, row in rows.items()
    }
    return Figures(
        f"time in ms from a press of the page's stop in Chromium to the drives' answer, {count} "
        f"presses each; {len(os.sched_getaffinity(0))} processors",
        rows,
        targets,
        notes=[f"{_OTHERS} of the 20 pages are plain connections that read like a page"],
        more={"presses": count},
    )


def _press(page: Page) -> float:
    """Press the stop button; return when, in s of CLOCK_MONOTONIC."""
    box = page.locator("button.stop").bounding_box()
    assert box is not None  # the button is in sight in every view
    page.mouse.move(box["x"] + box["width"] / 2, box["y"] + box["height"] / 2)
    page.mouse.down()
    page.mouse.up()
    time.sleep(_BRAKES_S)
    return float(page.evaluate("__press")) * 1e-3 - time.time() + time.monotonic()


def _answered_ms(log: Any, pressed_s: float) -> float:
    """Return the time from a press to the answers to the first command of another program."""
    first = int(np.searchsorted(log["stamp_ns"], 1e9 * pressed_s))
    programs = log["program"][first:]
    after = np.flatnonzero(programs != programs[0])
    if not after.size:
        raise WorkFailedError("a press of the page's stop did not stop the robot")
    row = log[first + int(after[0]) + 1]
    return 1e3 * (1e-9 * float(row["stamp_ns"]) + float(row["exchange_s"]) - pressed_s)


# What a page costs: start, rate, the service's processor, the loop, memory.


def measure(seconds: float, hours: float, out: Output) -> Figures:
    """Open the page of 8 axes at 1 kHz; nobody, one page, and 50 pages watch in turns."""
    with _chromium() as browser, _robot(_ROBOT) as (robot, handle, daemon, url):
        service = _service_pid(robot)
        to_and_fro = motion(robot, handle)
        next(to_and_fro)
        out.note(f"opening the page {_OPENINGS} times ...")
        opened_ms = []
        for _ in range(_OPENINGS):
            page = _opened(browser, url)
            opened_ms.append(float(page.evaluate("__painted")))
            page.context.close()
        cases: dict[str, list[dict[str, Any]]] = {"nobody": [], "1 page": [], "50 pages": []}
        for k in range(_ROUNDS):
            for case, runs in cases.items():
                out.note(f"round {k + 1} of {_ROUNDS}: {case} ...")
                with ExitStack() as stack:
                    pages = [] if case == "nobody" else [_opened(browser, url)]
                    if case == "50 pages":
                        stack.enter_context(_others(url, _MANY, _SLOW))
                    began = time.monotonic_ns(), processor_time_s(service), _cycles(pages)
                    while time.monotonic_ns() < began[0] + 1e9 * seconds / _ROUNDS:
                        next(to_and_fro)
                    took_s = 1e-9 * (time.monotonic_ns() - began[0])
                    runs.append({
                        "share": 100 * (processor_time_s(service) - began[1]) / took_s,
                        "rate": (_cycles(pages) - began[2]) / took_s,
                        "from_ns": began[0], "to_ns": time.monotonic_ns(),
                    })  # fmt: skip
                    watching = daemon.get("/status")["parts"]["service"]["live_clients"]
                    for page in pages:
                        page.context.close()
        log = handle.log()
        growth = _growth_MB(_opened(browser, url), hours, out)
    rows = {case: _row(runs, log) for case, runs in cases.items()}
    nobody, one, many = rows.values()
    share, rate = one["service"] - nobody["service"], one["cycles a second"]
    ratio = many["computing p99.9"] / nobody["computing p99.9"]
    shown_ms = float(np.median(opened_ms))
    return Figures(
        f"{robot.name}: service in % of a processor, cycles a second in the page, and the loop's "
        "times in us",
        rows,
        {
            "shown": Target("time until the page shows the robot, median, ms", shown_ms, 1000.0),
            "rate": Target("cycles a second in one page", rate, 0.9 * RATE_Hz, at_least=True),
            "share": Target("one page, % of a processor", share, 10.0),
            "loop": Target("computing p99.9, 50 pages / nobody", ratio, 1.1),
            "kept": Target(
                "pages that read, still connected",
                watching,
                _MANY + 1 - _SLOW,
                at_least=True,
            ),
            "dropped": Target("all pages still connected", watching, _MANY + 1 - _SLOW),
            "memory": Target(f"growth of a page over {hours:g} h, MB", growth, 50.0),
        },
        notes=[
            f"{_MANY} of 50 pages are plain connections that read like a page; {_SLOW} never read"
        ],
        more={"opened_ms": opened_ms, "seconds": seconds, "hours": hours},
    )


def _row(runs: list[dict[str, Any]], log: Any) -> Row:
    stamp = log["stamp_ns"]
    kept = np.any([(stamp >= one["from_ns"]) & (stamp <= one["to_ns"]) for one in runs], axis=0)
    row: Row = {
        "service": round(float(np.median([one["share"] for one in runs])), 1),
        "cycles a second": round(float(np.median([one["rate"] for one in runs])), 1),
    }
    for name, key in (("computing", "compute_s"), ("late by", "lateness_s")):
        us = percentiles(1e6 * log[key][kept], 50.0, 99.9, digits=1)
        row |= {f"{name} {p}": value for p, value in us.items()}
    return row


def _cycles(pages: list[Page]) -> int:
    return sum(int(page.evaluate("__cycles")) for page in pages)


def _service_pid(robot: Robot) -> int:
    for entry in Path("/proc").iterdir():
        with suppress(OSError):
            words = (entry / "cmdline").read_text()
            if "service_process" in words and str(robot.path) in words:
                return int(entry.name)
    raise WorkFailedError("the daemon's service is not running")


def _growth_MB(page: Page, hours: float, out: Output) -> float:
    """Return how much a page's memory grows while it gets the messages of hours."""
    session = page.context.new_cdp_session(page)
    session.send("Performance.enable")

    def used() -> float:
        session.send("HeapProfiler.collectGarbage")
        figures = session.send("Performance.getMetrics")["metrics"]
        return next(float(one["value"]) for one in figures if one["name"] == "JSHeapUsedSize")

    count = int(3600 * RATE_Hz * hours)
    with out.progress("messages", float(count)) as advance:
        page.evaluate(_REPLAY, [0, _BATCH])
        before = used()
        for begin in range(_BATCH, count, _BATCH):
            page.evaluate(_REPLAY, [begin, min(_BATCH, count - begin)])
            advance(float(begin))
    return (used() - before) / 1e6


# The other pages, in a separate process.


async def _read_like_pages(url: str, pages: int, slow: int) -> None:
    base, _, key = url.partition("/#key=")
    async with httpx.AsyncClient(headers={"Authorization": f"Bearer {key}"}) as http:
        sockets, reading = [], []
        for number in range(pages):
            ticket = (await http.post(f"{base}/ticket")).raise_for_status().json()["ticket"]
            address = f"{base.replace('http', 'ws', 1)}/live?rate_Hz={RATE_Hz}&fields={_FIELDS}"
            given = f"{address}&ticket={ticket}"
            sockets.append(await connect(given, max_queue=4, ping_interval=None))
            if number >= slow:
                reading.append(asyncio.create_task(_read(sockets[-1])))
    print("open", flush=True)
    await asyncio.to_thread(sys.stdin.read)
    for task in reading:
        task.cancel()


async def _read(socket: Any) -> None:
    with suppress(ConnectionClosed):
        async for _ in socket:
            pass


if __name__ == "__main__":
    asyncio.run(_read_like_pages(sys.argv[1], int(sys.argv[2]), int(sys.argv[3])))
