"""Where cables touch each other, the platform, or boxes of the frame."""
