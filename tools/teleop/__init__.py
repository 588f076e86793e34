"""Leading a robot by hand: what the hand holds, the stream it sends, what it is shown."""
