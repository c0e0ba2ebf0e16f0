"""`plan`: refine the grid until the answer is known to a tolerance; `check` of a user's problem."""
