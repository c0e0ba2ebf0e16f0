"""Fits of a circle to a batch of readings: exact curve or limacon, plain or robust, with correlated noise."""
