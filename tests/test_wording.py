"""Documentation, messages, docstrings and comments avoid idioms that readers must read twice."""

from __future__ import annotations

import ast
import io
import re
import tokenize
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
ANY_IDIOM = re.compile("|".join(IDIOMS))


def lines_of_documents() -> Iterator[tuple[str, str]]:
    for path in (ROOT / "README.md", *sorted((ROOT / "docs").rglob("*.md"))):
        for number, line in enumerate(path.read_text().splitlines(), 1):
            yield f"{path.relative_to(ROOT)}:{number}", line


def texts_of(path: Path) -> Iterator[tuple[str, str]]:
    """Yield the texts in a source file: messages, help, docstrings and comments."""
    source = path.read_text()
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.Constant) and isinstance(node.value, str):
            yield f"{path.relative_to(ROOT)}:{node.lineno}", node.value
    yield from comments_of(path, source)


def remarks_of(path: Path) -> Iterator[tuple[str, str]]:
    """Yield the docstrings and comments of a test file; its other texts quote the product."""
    source = path.read_text()
    if not ANY_IDIOM.search(source):  # this saves most of the time
        return
    for node in ast.walk(ast.parse(source)):
        match node:
            case ast.Expr(ast.Constant(str(text))):
                yield f"{path.relative_to(ROOT)}:{node.lineno}", text
    yield from comments_of(path, source)


def comments_of(path: Path, source: str) -> Iterator[tuple[str, str]]:
    if not any(ANY_IDIOM.search(line) for line in source.splitlines() if "#" in line):
        return
    for token in tokenize.generate_tokens(io.StringIO(source).readline):
        if token.type == tokenize.COMMENT:
            yield f"{path.relative_to(ROOT)}:{token.start[0]}", token.string


def test_documents_sources_and_tests_have_no_private_idiom() -> None:
    sources = [path for one in PRODUCT for path in sorted((ROOT / one).rglob("*.py"))]
    tests = sorted((ROOT / "tests").rglob("*.py"))
    read = [
        *lines_of_documents(),
        *(text for path in sources for text in texts_of(path)),
        *(text for path in tests for text in remarks_of(path)),
    ]
    assert len(read) > 10_000
    found = [
        f"{where}: {match.group()!r}: write {instead}"
        for where, text in read
        if ANY_IDIOM.search(text)
        for idiom, instead in IDIOMS.items()
        for match in re.finditer(idiom, text)
    ]
    assert not found, "\n".join(found)
