"""Link of `hwsim`."""
