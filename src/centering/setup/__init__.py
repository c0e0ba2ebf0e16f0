"""What the measurement hands on: changeover of the grinder, chatter, drift over parts."""
