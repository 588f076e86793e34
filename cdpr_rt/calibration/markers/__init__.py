"""Maps of printed markers from images of a camera that moves among them."""
