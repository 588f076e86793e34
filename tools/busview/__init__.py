"""What the `cdpr bus` commands do: scan, monitor, replay."""
