"""The measuring of a calibration: a robot and its camera go to poses, and what is read is kept."""
