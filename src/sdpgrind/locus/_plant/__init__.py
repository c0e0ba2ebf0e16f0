"""Hidden physics of the simulated adaptive grinder: its true optimum."""
