"""Controllers: plain classes with `update`, no input or output, no clock, no allocation."""
