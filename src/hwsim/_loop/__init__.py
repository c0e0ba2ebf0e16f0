"""Loop of `hwsim`."""
