"""Estimation from data."""
