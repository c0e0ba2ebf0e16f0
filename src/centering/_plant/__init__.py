"""Hidden physics of the simulated centering machine and probe: table, tip, ring, gauges."""
