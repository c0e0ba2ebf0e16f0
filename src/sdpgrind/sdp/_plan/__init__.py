"""`plan`: refine the grid to a tolerance; `check` of a user's problem."""
