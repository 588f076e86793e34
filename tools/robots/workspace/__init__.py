"""The workspace of a robot for people: searched, told, drawn, as a mesh."""
