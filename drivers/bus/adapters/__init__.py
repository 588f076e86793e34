"""One module for each kind of bus that a URL can name."""
