"""`AdaptiveGrinder`: a process whose burn limit drifts while it is kept at its optimum."""
