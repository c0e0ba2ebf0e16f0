"""Log of `hwsim`."""
