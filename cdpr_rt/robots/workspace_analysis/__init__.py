"""How far a robot's workspace reaches: by rays from a centre, by a grid, as a surface."""
