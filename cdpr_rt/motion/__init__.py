"""Set-points over time: trajectories, approaches, streams of poses."""
