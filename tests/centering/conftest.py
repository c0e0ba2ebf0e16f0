"""Figures that the tests of one file leave open are closed before those of the next."""

import sys

import pytest


@pytest.fixture(autouse=True, scope="module")
def _figures_closed():
    """Of more than 20 pyplot warns, and a warning fails a test; matplotlib is not loaded for that."""
    yield
    if pyplot := sys.modules.get("matplotlib.pyplot"):
        pyplot.close("all")
