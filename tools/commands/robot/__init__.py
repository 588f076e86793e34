"""`cdpr robot`, `path` and `poses`."""
