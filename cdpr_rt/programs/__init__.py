"""Programs: the set-points and controllers that a running robot can be commanded to run."""
