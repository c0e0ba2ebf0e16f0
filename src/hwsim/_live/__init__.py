"""Runs against a clock: releases, the last word on late commands, the operator, what a part took."""
