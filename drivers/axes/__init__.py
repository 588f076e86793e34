"""The group of axes that is exchanged once per cycle, its homing and its shutdown."""
