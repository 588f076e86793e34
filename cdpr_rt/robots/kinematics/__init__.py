"""Kinematics of n cables in two to six directions."""
