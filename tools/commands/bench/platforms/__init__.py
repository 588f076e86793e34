"""`cdpr bench` of platforms: kinematics, tensions, control, paths, workspace."""
