"""A cable robot as its file describes it: check its statics, draw it, and write new files."""
