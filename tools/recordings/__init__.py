"""The recordings of `cdpr log`: select, summarise, draw and export them."""
