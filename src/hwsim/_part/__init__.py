"""One part in the loop: clock ticks, routes of measurements and commands, commanded motions."""
