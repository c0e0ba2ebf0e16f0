"""Cycles of three stages as on a shop floor: rates, switching points, controller."""
