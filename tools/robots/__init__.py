"""A cable robot as its file describes it: what its cables can hold, checked, drawn, written."""
