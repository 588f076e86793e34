"""The command line, and the place where the other packages are wired together."""
