"""Solved policy: look-up, simulation, distribution of the final penalty, alternatives, pictures."""
