"""The commissioning report: one HTML file with pictures, made from the files of a commissioning."""
