"""`hwsim centering`: job from a file, work, lines, film of a cycle."""
