"""Study of `hwsim`."""
