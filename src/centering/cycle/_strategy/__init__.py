"""Sequence of pushes, solved beforehand: a stochastic dynamic program over offset and friction belief."""
