"""Part of `hwsim`."""
