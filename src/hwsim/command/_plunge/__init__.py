"""`hwsim plunge`: job from a file, work, lines."""
