"""`cdpr bench` of buses, cycles and the loop."""
