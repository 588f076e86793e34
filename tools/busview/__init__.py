"""Implementation of the `cdpr bus` commands: scan, monitor, replay."""
