"""Hidden physics of the simulated finishing cell: surface heights, true parameters, compiled steps."""
