"""The teleoperation experiment: a simulated operator leads a robot along a path of targets."""
