"""The teleoperation experiment: a modelled operator leads a robot along a path of targets."""
