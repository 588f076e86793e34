"""Whether a robot can work as its file describes it, and what would help where it cannot."""
