"""How good a fit is: on poses held out, by its covariance, and with further poses."""
