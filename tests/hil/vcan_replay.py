"""Run tests in one boot of the guest and pass their reports to the outer pytest."""

import json
import os
import sys
import tempfile
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

import pytest
import vcan_guest
from vcan_guest import NoGuestError

REPOSITORY = Path(__file__).parents[2]
GUEST_CACHE = REPOSITORY / "build" / "vcan-guest"
REPORTS_VARIABLE = "CDPR_VCAN_REPORTS"
# keep freed memory, because page faults are expensive in a guest kernel
_KEEP_MEMORY = {"MALLOC_MMAP_THRESHOLD_": str(32 << 20), "MALLOC_TRIM_THRESHOLD_": str(1 << 30)}


@dataclass(frozen=True)
class Outcome:
    """Reports by test name and the end of the guest's output, or why there was no guest."""

    reports: dict[str, list[dict[str, Any]]]
    output: str
    no_guest: str | None = None


def run_in_guest(names: Sequence[str]) -> Outcome:
    """Run tests, given by node ids, with a pytest inside the guest."""
    with tempfile.TemporaryDirectory(prefix="cdpr-vcan-", dir="/tmp") as scratch:
        written = Path(scratch) / "reports.jsonl"
        command = [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", *names]
        environment = {
            REPORTS_VARIABLE: str(written),
            "HOME": os.environ.get("HOME", "/root"),
            "PYTHONDONTWRITEBYTECODE": "1",
            # in the guest, forking a process with all modules costs more than loading them
            "CDPR_TEST_FORKS": "0",
            **_KEEP_MEMORY,
        }
        try:
            guest = vcan_guest.obtain(GUEST_CACHE)
            run = vcan_guest.run(guest, command, REPOSITORY, environment, Path(scratch))
        except NoGuestError as error:
            return Outcome({}, "", str(error))
        text = written.read_text(encoding="utf-8") if written.exists() else ""
    return Outcome(parse(text), f"{run.output}\nexit code {run.exit_code}")


def parse(text: str) -> dict[str, list[dict[str, Any]]]:
    """Return reports by test, from one JSON object per line. Ignore a truncated last line."""
    reports: dict[str, list[dict[str, Any]]] = {}
    for line in text.splitlines(keepends=True):
        if line.endswith("\n"):
            report = json.loads(line)
            reports.setdefault(report["nodeid"], []).append(report)
    return reports


def append(report: pytest.TestReport, path: str) -> None:
    """Write one report, inside the guest."""
    with Path(path).open("a", encoding="utf-8") as file:
        file.write(json.dumps(report._to_json()) + "\n")


def replay(item: pytest.Item, outcome: Outcome) -> Iterator[pytest.TestReport]:
    """Yield the guest's reports of a test, or a failure if the guest ended without them."""
    if outcome.no_guest is not None:
        reason = f"Skipped: no vcan0 here and no guest kernel: {outcome.no_guest}"
        yield _report(item, "skipped", (str(item.path), None, reason))
        return
    phases = outcome.reports.get(item.nodeid, [])
    for phase in phases:
        yield _restored(item, phase)
    if not any(phase["when"] == "teardown" for phase in phases):
        words = f"did not end in the guest, whose last words were:\n{outcome.output}"
        yield _report(item, "failed", words)


def _restored(item: pytest.Item, data: dict[str, Any]) -> pytest.TestReport:
    if isinstance(data.get("longrepr"), list):  # a skip: path, line, reason
        data = data | {"longrepr": tuple(data["longrepr"])}
    report = pytest.TestReport._from_json(data)
    report.nodeid = item.nodeid
    return report


def _report(
    item: pytest.Item, outcome: Literal["failed", "skipped"], longrepr: str | tuple[str, None, str]
) -> pytest.TestReport:
    keywords = dict(item.keywords)
    return pytest.TestReport(item.nodeid, item.location, keywords, outcome, longrepr, "call")
