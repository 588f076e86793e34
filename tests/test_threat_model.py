"""Each test that the threat model names exists."""

from __future__ import annotations

import ast
import re
from pathlib import Path

TESTS = Path(__file__).parent
PAGE = TESTS.parent / "docs" / "reference" / "threat-model.md"


def test_each_named_test_exists_and_each_row_names_a_test() -> None:
    text = PAGE.read_text()
    named = re.findall(r"`([a-z_0-9/]+\.py)::(test_\w+)`", text)
    assert len(named) > 40
    there = {
        file: {
            one.name
            for one in ast.walk(ast.parse((TESTS / file).read_text()))
            if isinstance(one, ast.FunctionDef)
        }
        for file in {file for file, _ in named}
    }
    assert [f"{file}::{name}" for file, name in named if name not in there[file]] == []
    tables = text.partition("## What they cannot do")[2].partition("## What is not defended")[0]
    rows = [line for line in tables.splitlines() if line.startswith("| ")]
    assert [row for row in rows if "::test_" not in row and not row.startswith("| attempt")] == []
