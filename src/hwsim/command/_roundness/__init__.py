"""Folder of `hwsim roundness`: from the file of a roundness tester to a sheet to sign."""
