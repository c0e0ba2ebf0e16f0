"""Hidden physics of the simulated adaptive grinder: what could be had at best."""
