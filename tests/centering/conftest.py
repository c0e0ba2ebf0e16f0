"""Tests of centering leave no figure open: pyplot warns where more than 20 are, and warnings are errors."""

import sys

import pytest


@pytest.fixture(autouse=True)
def closed_figures():
    """Close what a test drew, unless nothing has drawn yet."""
    yield
    if pyplot := sys.modules.get("matplotlib.pyplot"):
        pyplot.close("all")
