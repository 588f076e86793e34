"""A camera on the platform in the fit: its model, its residuals, where to begin, what is wrong."""
