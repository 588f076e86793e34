"""Quality of a fit: on poses held out, by its covariance, and with further poses."""
