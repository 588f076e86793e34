"""A drive for simulators that live by the wall clock on a machine that may be slow."""

from __future__ import annotations

from pathlib import Path

import cdpr_profiles

NAME = "tolerant"


def write_tolerant_drive(folder: Path) -> None:
    """Write the shipped drive that lets itself and its master be held up for seconds."""
    shipped = Path(cdpr_profiles.__file__).parent / "drives" / "generic-cia402.toml"
    text = shipped.read_text()
    for before, after in (
        ("heartbeat_producer_s = 0.1 ", "heartbeat_producer_s = 5.0 "),
        ("heartbeat_consumer_s = 0.5", "heartbeat_consumer_s = 10.0"),
        ('eds = "generic-cia402.eds"', f'eds = "{shipped.with_suffix(".eds")}"'),
    ):
        assert before in text
        text = text.replace(before, after)
    (folder / f"{NAME}.toml").write_text(text)
