"""Controllers of an axis: position loop, compensation, their tuning and validation."""
