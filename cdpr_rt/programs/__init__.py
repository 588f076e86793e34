"""Programs that a command starts on a running robot: set-points and their controllers."""
