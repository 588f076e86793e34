"""Commands of devices beside the winches: rails, safety inputs and outputs."""
