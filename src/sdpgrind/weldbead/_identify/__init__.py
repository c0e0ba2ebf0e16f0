"""Coefficients, their scatter and its attribution, the way beside the bead, from logs of passes."""
