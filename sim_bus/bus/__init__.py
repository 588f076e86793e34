"""The simulated CAN bus: a hub that counts bus time."""
