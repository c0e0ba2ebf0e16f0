"""Tests of finishing find `finishing_inside` beside this file, and matplotlib without a window."""

import pytest


@pytest.fixture
def pyplot():
    pyplot = pytest.importorskip("matplotlib.pyplot")
    pyplot.switch_backend("agg")
    yield pyplot
    pyplot.close("all")
