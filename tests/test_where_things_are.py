"""The page that says where things are names files that there are."""

from __future__ import annotations

import re
from pathlib import Path

ROOT = Path(__file__).parents[1]
PATHS = re.compile(r"`((?:cdpr_rt|drivers|profiles|sim_bus|tools)/[\w/.]+)`")


def test_each_path_exists() -> None:
    paths = PATHS.findall((ROOT / "docs/where-things-are.md").read_text())
    assert len(paths) > 50
    assert [path for path in paths if not (ROOT / path).exists()] == []
