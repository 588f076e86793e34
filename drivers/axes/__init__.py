"""The group of axes exchanged once per cycle, its homing and its shutdown."""
