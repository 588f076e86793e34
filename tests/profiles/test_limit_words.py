"""What is declared of the limits."""

from __future__ import annotations

from cdpr_profiles.limits.robot_limits import Limit


def test_each_text_takes_value_and_allowed_value() -> None:
    """A limit without a text is told by whoever found it."""
    for limit in Limit:
        assert limit.text.count("{") <= 2
        limit.text.format(1.0, 2.0)
