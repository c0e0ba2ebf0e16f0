"""Tests of finishing find `finishing_inside` beside this file."""
