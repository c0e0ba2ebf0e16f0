"""Quantities with units: exact where they can be, refused where they cannot."""

import math

import pytest
from hwsim_inside import parse, quantity
from hypothesis import given
from hypothesis import strategies as st

from sdpgrind import units


@pytest.mark.parametrize(
    ("value", "unit", "expected"),
    [
        (150, "mm", 150.0),
        ("150 mm", "mm", 150.0),
        ("150", "mm", 150.0),
        ("0.15m", "mm", 150.0),
        ("7 in", "mm", 177.8),
        ("5 um", "mm", 0.005),
        ("5 µm", "mm", 0.005),
        ("-1.5e-1 cm", "mm", -1.5),
        ("12.8 J/mm^3", "J/mm^3", 12.8),
        ("12.8 J / mm³", "J/mm^3", 12.8),
        ("12.8e3 N*mm/mm^3", "J/mm^3", 12.8),
        ("1 hp", "W", 745.6998715822702),
        ("2 min", "s", 120.0),
        ("600 mm/min", "mm/s", 10.0),
        ("30 %", "", 0.3),
        ("0.3", "", 0.3),
        ("16 N/(mm/s)^0.5", "N/(mm/s)^(1/2)", 16.0),
        ("50 ct/mm", "$/mm", 0.5),
        ("0.25 $ s^-1", "$/s", 0.25),
        ("0.1 rad/(s N mm)", "rad/(s N mm)", 0.1),
        ("0.1 rad/s/N/mm", "rad/(s N mm)", 0.1),
    ],
)
def test_exact_to_the_last_bit(value, unit, expected):
    assert quantity("x", value, unit) == expected


@pytest.mark.parametrize(
    ("text", "unit", "same"),
    [("300 rpm", "rad/s", units.rpm(300)), ("80 Hz", "rad/s", units.hz(80)), ("20°", "rad", units.deg(20))],
)
def test_agrees_with_the_conversions_of_the_library(text, unit, same):
    assert quantity("x", text, unit) == pytest.approx(same, rel=1e-15)


@given(
    st.floats(-1e6, 1e6),
    st.sampled_from(["mm", "J/mm^3", "rad/(s N mm)", "N/(mm/s)^(1/2)", "$/mm^2", "mm^3/s"]),
)
def test_own_unit_changes_nothing(value, unit):
    assert quantity("x", f"{value!r} {unit}", unit) == value


def test_roots_of_units():
    assert float(parse("mm^(1/2)").factor) == pytest.approx(math.sqrt(1e-3))
    assert quantity("x", "16 N s^0.5/mm^0.5", "N/(mm/s)^(1/2)") == pytest.approx(16.0)


@pytest.mark.parametrize(
    ("value", "unit", "message"),
    [
        ("150 N", "mm", "x must have a unit like mm; got '150 N'"),
        ("80 1/s", "rad/s", "x must have a unit like rad/s; got '80 1/s'"),
        ("7 mm", "", r"x must have a unit like 1 \(none\); got '7 mm'"),
        ("7 parsec", "mm", "x must have a unit like mm; got '7 parsec': 'parsec' is no unit known here"),
        ("7 mm/", "mm", "got '7 mm/': a unit is missing at the end"),
        ("7 (mm", "mm", r"got '7 \(mm': a parenthesis is not closed"),
        ("7 mm)", "mm", r"got '7 mm\)': '\)' is out of place"),
        ("7 mm^x", "mm", "got '7 mm^x': 'x' is no exponent".replace("^", r"\^")),
        ("7 mm^(1/0)", "mm", "is no exponent"),
        ("7 mm & s", "mm", "'& s' is no unit"),
        ("much", "mm", r"x must be a number \(mm\) or a text such as \"3 mm\"; got 'much'"),
    ],
)
def test_refused_texts(value, unit, message):
    with pytest.raises(ValueError, match=message):
        quantity("x", value, unit)


@pytest.mark.parametrize("value", [True, None, [1.0]])
def test_refused_types(value):
    with pytest.raises(TypeError, match=r"x must be a number \(mm\); got"):
        quantity("x", value, "mm")
