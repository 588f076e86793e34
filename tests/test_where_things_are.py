"""Each file and name in code that the documentation refers to exists."""

from __future__ import annotations

import re
from pathlib import Path
from pkgutil import resolve_name

from cdpr_profiles.platform import DISTRIBUTIONS

ROOT = Path(__file__).parents[1]
PACKAGES = ("cdpr_rt", "drivers", "profiles", "sim_bus", "tools")
PATHS = re.compile(rf"`((?:{'|'.join(PACKAGES)})/[\w/.]+)`")
NAMES = re.compile(r"\bcdpr_(?:rt|drivers|profiles|sim_bus|tools)(?:\.[A-Za-z_]\w*)+")


def test_each_path_in_where_things_are_exists() -> None:
    paths = PATHS.findall((ROOT / "docs/explanation/where-things-are.md").read_text())
    assert len(paths) > 50
    assert [path for path in paths if not (ROOT / path).exists()] == []


def test_each_dotted_name_in_the_documentation_exists() -> None:
    pages = [ROOT / "README.md", *(ROOT / "docs").rglob("*.md")]
    names = {name for page in pages for name in NAMES.findall(page.read_text())}
    assert len(names) > 5
    for name in names - {DISTRIBUTIONS}:  # a group of entry points
        resolve_name(name)
