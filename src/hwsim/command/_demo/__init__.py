"""Folder of `hwsim demo`: a measured bore, and the way from its file to a report."""
