"""Cycles of three stages as on a shop floor: their rates and switching points, the controller that follows them."""
