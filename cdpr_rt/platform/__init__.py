"""Control of a platform on its cables: loop, its design, and learning of the motors."""
