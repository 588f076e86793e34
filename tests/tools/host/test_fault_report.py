"""`cdpr doctor --report` writes a report without secrets."""

from pathlib import Path

import pytest
from cdpr_here import cdpr_here

KEY = "0123456789abcdef0123456789abcdef"


def test_a_report_contains_versions_checks_and_robots_but_no_keys(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path))
    monkeypatch.setenv("SOME_KEY", KEY)
    folder = tmp_path / "cdpr-rt" / "recordings"
    folder.mkdir(parents=True)
    (folder / "broken.mcap").write_text("no recording")
    report = tmp_path / "report.txt"
    asked = ("doctor", "--report", report, "--robot", "planar-3")
    cdpr_here(*asked)  # the exit status depends on the machine
    text = report.read_text()
    for part in ("== versions", "numpy ", "embedded bus", "[[axes]]", "broken.mcap: not a rec"):
        assert part in text
    assert KEY not in text
    again = cdpr_here(*asked)
    assert again.returncode == 2 and "already exists" in again.stderr
