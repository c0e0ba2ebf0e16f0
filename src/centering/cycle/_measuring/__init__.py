"""Measuring a part on the table: settings, the filter of its place and form, rotations that it takes."""
