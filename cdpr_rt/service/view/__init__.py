"""The live view, by the Foxglove protocol."""
