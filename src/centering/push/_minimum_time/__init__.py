"""Push of minimum time within limits of the tip: nonlinear program, search, result."""
