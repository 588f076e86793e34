"""Control of a platform on n cables in 2 to 6 directions, designed for each robot."""
