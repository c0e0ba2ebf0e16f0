"""Which push next, solved beforehand: the cycle as a stochastic dynamic program over offset and belief of the friction."""
