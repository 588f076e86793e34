"""How good a calibration is: judged beside what a simulator knows, drawn and reported."""
