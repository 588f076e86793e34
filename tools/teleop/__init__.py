"""Lead a robot by hand: input devices, the set-point stream, and the operator's view."""
