"""Documentation, help and messages avoid idioms that readers have to read twice."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator
from pathlib import Path

ROOT = Path(__file__).parents[1]
PRODUCT = ("cdpr_rt", "drivers", "profiles", "sim_bus", "tools")
IDIOMS = {
    r"\b(is|are) told\b|\btells? of\b": "reports, shows, warns",
    r"\banew\b": "again",
    r"\bby (itself|themselves)\b": "alone, or nothing",
    r"\bof (its|their) own\b": "separate",
    r"\bat once\b": "immediately, together",
    r"\bas well\b(?! as)": "also",
    r"\bheld against\b": "checked against",
    r"\blet(s|ting)? go\b|\b(gives?|given) back\b": "releases, returns",
    r"\blets? down\b": "lowers",
    r"\bin words\b": "as text",
    r"\bof which\b|\b(is|are) none\b": "a sentence with a subject",
    r"\bwhere (it|they) can\b": "if",
    r"\b(is|are) refused\b": "is rejected",
    r"\bnothing is known of\b": "unidentified",
}
"""Regular expression of an idiom, and what to write instead."""


def lines_of_documents() -> Iterator[tuple[str, str]]:
    for path in (ROOT / "README.md", *sorted((ROOT / "docs").rglob("*.md"))):
        for number, line in enumerate(path.read_text().splitlines(), 1):
            yield f"{path.relative_to(ROOT)}:{number}", line


def texts_of(path: Path) -> Iterator[tuple[str, str]]:
    """Yield the texts in a source file, and the docstrings of commands, which are their help."""
    tree = ast.parse(path.read_text())
    comments = {
        id(node.value)
        for node in ast.walk(tree)
        if isinstance(node, ast.Expr)
        and isinstance(node.value, ast.Constant)
        and not (path.parent.name == "commands" and is_help(node, tree))
    }
    for node in ast.walk(tree):
        if (
            isinstance(node, ast.Constant)
            and isinstance(node.value, str)
            and id(node) not in comments
        ):
            yield f"{path.relative_to(ROOT)}:{node.lineno}", node.value


def is_help(docstring: ast.Expr, tree: ast.Module) -> bool:
    return any(
        isinstance(node, ast.FunctionDef) and node.decorator_list and node.body[0] is docstring
        for node in ast.walk(tree)
    )


def test_documents_help_and_messages_have_no_private_idiom() -> None:
    sources = [path for one in PRODUCT for path in sorted((ROOT / one).rglob("*.py"))]
    read = [*lines_of_documents(), *(text for path in sources for text in texts_of(path))]
    assert len(read) > 10_000
    found = [
        f"{where}: {match.group()!r}: write {instead}"
        for where, text in read
        for idiom, instead in IDIOMS.items()
        for match in re.finditer(idiom, text)
    ]
    assert not found, "\n".join(found)
