"""The page of common mistakes shows the messages that the commands print."""

from __future__ import annotations

import os
import tempfile
from collections.abc import Iterator
from pathlib import Path

import pytest
from cdpr_here import cdpr_here

import cdpr_profiles

PAGE = Path(__file__).resolve().parents[3] / "docs" / "reference" / "mistakes.md"
SHIPPED = Path(cdpr_profiles.__file__).parent / "robots" / "planar-3.toml"
WRITE = "CDPR_WRITE_PAGES"
"""If this variable is set, the page is written instead of compared."""
MISTAKES = (
    ("Misspelt command", "cdpr comission planar-3"),
    ("Misspelt option", "cdpr doctor --jsn"),
    ("Misspelt robot", "cdpr robot show planar3"),
    ("Misspelt key in a robot's file", "cdpr robot show misspelt.toml"),
    ("Unknown bus in a robot's file", "cdpr robot show other-bus.toml"),
    ("Bus without its kind", "cdpr run planar-3 --bus can0"),
    ("Simulated bus that is not running", "cdpr drive info winch-mpp0923d --bus simbus:lab"),
    ("No daemon is running", "cdpr move --to 300 2000"),
    ("Output folder already used", "cdpr commission winch-mpp0923d --bus simbus: --out used"),
    ("Motor not chosen", "cdpr commission planar-3 --bus simbus:"),
    ("Open to the network without a key", "cdpr run planar-3 --bus simbus: --http 0.0.0.0:8080"),
    ("Key file that others can read", "cdpr status --url http://robot:8080 --key-file key"),
    ("Robot's file that already exists", "cdpr robot new misspelt.toml"),
    ("File that is not a recording", "cdpr log info notes.mcap"),
)
HEAD = """\
# Common mistakes and their messages

Each row shows a command with a mistake and the message that it prints. Exit status 2 means invalid
input: nothing was done, and nothing had power. Exit status 1 means that the work failed. A message
about a file names the file, the key, the value and the allowed values.

| mistake | command | message | exit status |
|---|---|---|---|
"""


@pytest.fixture
def tmp_path() -> Iterator[Path]:
    """Yield a folder with a name short enough for sockets."""
    with tempfile.TemporaryDirectory(prefix="cdpr-") as folder:
        yield Path(folder)


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Yield a working folder with invalid files, for a user without a daemon."""
    for name in ("XDG_RUNTIME_DIR", "XDG_STATE_HOME"):
        monkeypatch.setenv(name, str(tmp_path / name.lower()))
    robot = SHIPPED.read_text()
    (tmp_path / "misspelt.toml").write_text(robot.replace("mass_kg", "mas_kg"))
    (tmp_path / "other-bus.toml").write_text(robot.replace('bus = "can0"', 'bus = "can1"', 1))
    (tmp_path / "notes.mcap").write_text("notes of the day, and some more of them")
    (tmp_path / "key").write_text("0123456789abcdef")
    (tmp_path / "key").chmod(0o644)
    (tmp_path / "used" / "raw").mkdir(parents=True)
    (tmp_path / "used" / "raw" / "sweep-0.raw").write_bytes(b"")
    return tmp_path


def answered(command: str, folder: Path) -> tuple[str, int]:
    """Return the output of a command in one line, and its exit status."""
    ended = cdpr_here(*command.split()[1:], cwd=folder)
    assert "Traceback" not in ended.stderr
    told = [line.strip() for line in ended.stderr.splitlines() if not line.endswith(" ...")]
    return " ".join(told).replace(f"{folder}/", "").removeprefix("cdpr: "), ended.returncode


def test_each_mistake_prints_the_message_on_the_page(folder: Path) -> None:
    rows = []
    for mistake, command in MISTAKES:
        said, status = answered(command, folder)
        assert status in (1, 2) and said, command
        assert "Input should" not in said and "Value error" not in said
        rows.append(f"| {mistake} | `{command}` | {said.replace('|', chr(92) + '|')} | {status} |")
    page = HEAD + "\n".join(rows) + "\n"
    if WRITE in os.environ:
        PAGE.write_text(page)
    assert PAGE.read_text() == page, f"to write it anew: {WRITE}=1"
