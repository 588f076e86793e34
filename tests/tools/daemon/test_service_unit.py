"""`cdpr service-unit`, checked by systemd, and the settings that it shares with `cdpr run`."""

from __future__ import annotations

import os
import re
import shlex
import shutil
import subprocess
import sys
from pathlib import Path
from urllib.parse import parse_qs, urlsplit

import pytest
from cdpr_here import cdpr_here
from hypothesis import given
from hypothesis import strategies as st

from cdpr_profiles import load_robot
from cdpr_tools.commands.service_unit import service_unit
from cdpr_tools.daemon.launcher import ServiceManager
from cdpr_tools.daemon.paths import default_socket, find_sockets
from cdpr_tools.daemon.settings import Address, RunSettings, is_loopback, read_key
from cdpr_tools.errors import BadInputError


def _value(unit: str, key: str) -> str:
    return next(line for line in unit.splitlines() if line.startswith(f"{key}=")).partition("=")[2]


def test_the_unit_starts_the_requested_daemon_with_absolute_paths(tmp_path: Path) -> None:
    key = tmp_path / "key file"
    key.write_text("0123456789abcdef0123456789abcdef\n")
    key.chmod(0o600)
    asked = ("--http", "0.0.0.0:8000", "--key-file", "key file", "--live", "0", "--read-only")
    made = cdpr_here("service-unit", "spatial-8", "--user", "robot", *asked, cwd=tmp_path)
    assert made.returncode == 0, made.stderr
    words = shlex.split(_value(made.stdout, "ExecStart"))
    assert words[1:4] == ["run", "spatial-8", "--yes"]
    assert os.access(words[0], os.X_OK)
    assert words[words.index("--key-file") + 1] == str(key)
    assert words[words.index("--socket") + 1] == "/run/cdpr-rt/spatial-8.sock"
    assert words[words.index("--live") + 1] == "0"
    assert "--read-only" in words
    assert _value(made.stdout, "RuntimeDirectoryMode") == "0700"
    assert _value(made.stdout, "UMask") == "0077"
    assert _value(made.stdout, "User") == "robot"
    # the kernel's names of the robot's interfaces, so that the unit starts when they exist
    assert "sys-subsystem-net-devices-can1.device" in _value(made.stdout, "Wants")


def _complaints(unit: Path) -> str:
    """Return systemd's warnings about a unit, "" without systemd."""
    judge = shutil.which("systemd-analyze")
    if judge is None:
        return ""
    said = subprocess.run(
        [judge, "verify", str(unit)], capture_output=True, text=True, timeout=60, check=False
    )
    return said.stdout + said.stderr


def test_systemd_reports_no_problem_with_the_unit(tmp_path: Path) -> None:
    robot = load_robot("spatial-8")
    unit = tmp_path / "cdpr-spatial-8.service"
    odd = ["--key-file", "/etc/a $HOME \"b\" 'c' \\ %h;"]
    for options in ([], odd):
        text = service_unit(robot, [], options, "root")
        lines = [line for line in text.splitlines() if line and line[0] not in "#["]
        assert all(re.fullmatch(r"[A-Z][A-Za-z]+=.*", line) for line in lines)
        unit.write_text(text)
        assert _complaints(unit) == ""
    assert _value(text, "ExecStart").endswith(""""/etc/a $$HOME \\"b\\" 'c' \\\\ %%h;\"""")


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (("--http", "0.0.0.0:8000"), "--key-file"),
        (("--stream", "[::]:8000"), "--key-file"),
        (("--http", "there"), "HOST:PORT"),
        (("--http", "host:65536"), "HOST:PORT"),
        (("--key-file", "/nowhere/key"), "cannot be read"),
        (("--plant", "here.toml"), "simbus:"),
        (("--record", "here", "--no-record"), "one of them"),
        (("--stream", "7710", "--no-stream"), "one of them"),
        (("--allow-code",), "a service must not allow code that changes later"),
    ],
)
def test_a_unit_for_an_invalid_run_is_rejected(options: tuple[str, ...], words: str) -> None:
    made = cdpr_here("service-unit", "spatial-8", *options)
    assert made.returncode == 2
    assert made.stdout == ""
    assert words in made.stderr
    assert "Traceback" not in made.stderr
    assert len(made.stderr.strip().splitlines()) == 1


def test_the_address_of_the_page_keeps_every_character_of_the_key(tmp_path: Path) -> None:
    key = tmp_path / "key"
    key.write_text("ab+/&=#%25 0123456789\n")
    key.chmod(0o600)
    at = Address(host="127.0.0.1", port=0)
    asked = RunSettings(robot="r", name="r", socket=tmp_path / "s", http=at, key_file=key)
    settings = asked.with_key_loaded().with_ports_bound()
    read = parse_qs(urlsplit(settings.page_url()).fragment)
    os.close(settings.http_fd)
    os.close(settings.key_fd)
    assert read == {"key": ["ab+/&=#%25 0123456789"]}


def test_a_key_must_be_long_and_readable_only_by_its_owner(tmp_path: Path) -> None:
    key = tmp_path / "key"
    key.write_bytes(b"0123456789abcdef\nthe rest does not count")
    key.chmod(0o640)
    with pytest.raises(BadInputError, match="others may read it"):
        read_key(key)
    key.chmod(0o600)
    assert read_key(key) == b"0123456789abcdef"
    for short in (b"", b"0123456789abcde", b"\n0123456789abcdef", "0123456789abcdéf".encode()):
        key.write_bytes(short)
        with pytest.raises(BadInputError, match="allowed: 16"):
            read_key(key)
    key.write_bytes(b"k" * 4096)
    assert read_key(key) == b"k" * 4096
    key.write_bytes(b"k" * 4097)  # a truncated key would differ from that of the owner
    with pytest.raises(BadInputError, match="allowed: up to 4096 bytes"):
        read_key(key)


@given(st.text(alphabet="0123456789abcdef:.[]-", max_size=24))
def test_an_address_is_parsed_or_rejected(text: str) -> None:
    try:
        address = Address.parse("--http", text)
    except BadInputError as error:
        assert "allowed" in str(error)
        return
    assert 0 <= address.port <= 65535
    assert Address.parse("--http", str(address)) == address


def test_only_loopback_is_trusted() -> None:
    trusted = ("127.0.0.1", "127.8.8.8", "::1", "localhost")
    others = ("0.0.0.0", "::", "192.168.1.2", "example.org", "127.0.0.1.example.org", "localhost.")
    assert all(map(is_loopback, trusted))
    assert not any(map(is_loopback, others))


def test_settings_are_passed_unchanged_to_other_processes(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    settings = RunSettings(
        robot="spatial-8",
        name="spatial-8",
        buses=("can0=socketcan:can0", "can1=socketcan:can1"),
        socket=tmp_path / "s",
        http=Address(host="::1", port=1),
        record=Path("here"),
        block_fd=5,
    )
    monkeypatch.setattr(sys, "argv", ["loop", settings.model_dump_json()])
    assert RunSettings.from_argv() == settings
    assert settings.record == Path.cwd() / "here"


def test_the_folder_of_sockets_is_private_to_its_user(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path))
    folder = default_socket("a").parent
    assert folder.stat().st_mode & 0o777 == 0o700
    assert find_sockets("a") == []
    folder.chmod(0o777)
    with pytest.raises(BadInputError, match="open to others"):
        default_socket("a")
    folder.rmdir()
    folder.symlink_to(tmp_path)
    with pytest.raises(BadInputError, match="open to others"):
        default_socket("a")


def test_notifications_need_a_socket_and_the_own_watchdog_pid(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.delenv("NOTIFY_SOCKET", raising=False)
    assert not ServiceManager().asks
    # the watchdog belongs to another process
    monkeypatch.setenv("NOTIFY_SOCKET", "@cdpr-nobody-listens-here")
    monkeypatch.setenv("WATCHDOG_USEC", "1000000")
    monkeypatch.setenv("WATCHDOG_PID", "1")
    manager = ServiceManager()
    assert manager.asks
    assert manager.watchdog_s == 0.0
    assert "NOTIFY_SOCKET" not in os.environ
    manager.notify(READY=1)  # a missing receiver is not an error
