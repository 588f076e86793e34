"""Which poses a robot reaches straight from another, held all the way and without contact."""
