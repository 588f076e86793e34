"""The daemon's composition: its processes and what each is given."""
