"""Coefficients, their scatter and its attribution from logs of passes."""
