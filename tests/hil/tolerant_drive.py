"""A drive profile with long timeouts for paced simulators on a slow machine."""

from __future__ import annotations

from pathlib import Path

import cdpr_profiles

NAME = "tolerant"
MASTER_HEARTBEAT_S = 6.0
_WINCH = "winch-mpp0923d"


def write_tolerant_drive(folder: Path, producer_s: float = 5.0, consumer_s: float = 10.0) -> Path:
    """Write the shipped drive with timeouts of seconds. Return the file.

    It sends a heartbeat every `producer_s`, waits `consumer_s` for that of its master, and may take
    5 s to show a mode.
    """
    shipped = Path(cdpr_profiles.__file__).parent / "drives" / "generic-cia402.toml"
    text = shipped.read_text()
    for before, after in (
        ("mode_display_timeout_s = 0.5", "mode_display_timeout_s = 5.0"),
        ("heartbeat_producer_s = 0.1 ", f"heartbeat_producer_s = {producer_s} "),
        ("heartbeat_consumer_s = 0.5", f"heartbeat_consumer_s = {consumer_s}"),
        ('eds = "generic-cia402.eds"', f'eds = "{shipped.with_suffix(".eds")}"'),
    ):
        assert before in text
        text = text.replace(before, after)
    path = folder / f"{NAME}.toml"
    path.write_text(text)
    return path


def write_tolerant_robot(path: Path, text: str) -> None:
    """Write a robot of the shipped winches whose master may be delayed by seconds."""
    winch = (Path(cdpr_profiles.__file__).parent / "winches" / f"{_WINCH}.toml").read_text()
    (path.parent / "winch.toml").write_text(winch.replace('"generic-cia402"', f'"{NAME}"'))
    write_tolerant_drive(path.parent)
    assert f'"{_WINCH}"' in text
    heartbeat = f"master_heartbeat_s = {MASTER_HEARTBEAT_S}\n"
    path.write_text(heartbeat + text.replace(f'"{_WINCH}"', '"winch.toml"'))
