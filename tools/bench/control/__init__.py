"""One update of a platform's control, beside the same in NumPy and SciPy."""
