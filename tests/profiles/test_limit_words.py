"""What is declared of the limits, against the page that tells people of them."""

from __future__ import annotations

import re
from pathlib import Path

from cdpr_profiles.limits.robot_limits import Limit

_PAGE = Path(__file__).parents[2] / "docs" / "supervisor.md"


def test_the_page_lists_each_limit_with_its_reaction() -> None:
    """In the order of their numbers or not, none twice."""
    rows = re.findall(r"^\| `(\w+)` \|.*\| ([a-z ]+) \|$", _PAGE.read_text(), re.MULTILINE)
    assert sorted(rows) == sorted((limit.key, limit.reaction) for limit in Limit if limit)


def test_each_text_takes_value_and_allowed_value() -> None:
    """A limit without a text is told by whoever found it."""
    for limit in Limit:
        assert limit.text.count("{") <= 2
        limit.text.format(1.0, 2.0)
