"""`hwsim weldbead`: job from a file, work, lines."""
