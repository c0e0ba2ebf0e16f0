"""One part in the loop: ticks of its clock, routes of measurements and commands, motions that run on their own."""
