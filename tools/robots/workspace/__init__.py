"""The workspace of a robot for people: searched, in words, drawn, as a mesh."""
