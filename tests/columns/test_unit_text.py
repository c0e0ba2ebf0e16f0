"""Quantities with units: exact where they can be, refused where they cannot."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from sdpgrind import units
from sdpgrind.base.unit_text import factor, near, parse, quantity


@pytest.mark.parametrize(
    ("value", "unit", "expected"),
    [
        (150, "mm", 150.0),
        ("150 mm", "mm", 150.0),
        ("150", "mm", 150.0),
        ("0.15m", "mm", 150.0),
        ("7 in", "mm", 177.8),
        ("32 µin", "mm", 0.0008128),
        ("32 uin", "mm", 0.0008128),
        ("1 microinch", "mm", 0.0000254),
        ("400 gon", "rad", 2 * math.pi),
        ("5 Mikrometer", "mm", 0.005),
        ("3 msec", "s", 0.003),
        ("600 mm/min.", "mm/s", 10.0),
        ("2 N.m", "N mm", 2000.0),
        ("2 Kilowatt", "W", 2000.0),
        ("180 degrees", "rad", math.pi),
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
        ("0,282 mm", "mm", "must have a unit like mm; got '0,282 mm': a decimal sign is a point"),
    ],
)
def test_refused_texts(value, unit, message):
    with pytest.raises(ValueError, match=message):
        quantity("x", value, unit)


@pytest.mark.parametrize("value", [True, None, [1.0]])
def test_refused_types(value):
    with pytest.raises(TypeError, match=r"x must be a number \(mm\); got"):
        quantity("x", value, "mm")


@pytest.mark.parametrize(
    ("written", "unit", "expected"),
    [
        ("kp", "N", 9.80665), ("kgf", "N", 9.80665), ("daN", "N", 10.0), ("PS", "W", 735.49875), ("ms", "s", 1e-3),
        ("us", "s", 1e-6), ("nm", "mm", 1e-6), ("Nm", "N mm", 1e3), ("J/mm3", "J/mm^3", 1.0), ("Zoll", "mm", 25.4),
        ("micron", "mm", 1e-3), ("microns", "mm", 1e-3), ("Mikron", "mm", 1e-3), ("thou", "mm", 0.0254),
        ("inches", "mm", 25.4), ("sec", "s", 1.0), ("Sek", "s", 1.0), ("min", "s", 60.0), ("kw", "W", 1e3),
        ("KW", "W", 1e3), ("hp", "W", 745.6998715822702), ("ipm", "mm/s", 25.4 / 60), ("cc/min", "mm^3/s", 1000 / 60),
        ("ccm/min", "mm^3/s", 1000 / 60), ("mm3/s", "mm^3/s", 1.0), ("mm·s⁻¹", "mm/s", 1.0), ("mm s^-1", "mm/s", 1.0), ("cm³/min", "mm^3/s", 1000 / 60),
        ("µm", "mm", 1e-3), ("1", "", 1.0), ("%", "1", 0.01), ("m s-2", "mm/s^2", 1e3), ("Grad", "rad", math.pi / 180),
        ("MM/MIN", "mm/s", 1 / 60), ("IN/SEC", "mm/s", 25.4), ("KN", "N", 1e3), ("RPM", "rad/s", math.pi / 30), ("DEG", "rad", math.pi / 180),
        ("Millisekunden", "s", 1e-3), ("milliseconds", "s", 1e-3), ("ns", "s", 1e-9), ("hours", "s", 3600.0), ("Stunden", "s", 3600.0), ("hrs", "s", 3600.0), ("mins", "s", 60.0),
        ("days", "s", 86400.0), ("kilowatts", "W", 1e3), ("Millimeters", "mm", 1.0), ("MICROINCHES", "mm", 2.54e-5), ("metres", "mm", 1e3),
        ("Newtons", "N", 1.0), ("Ampere", "A", 1.0), ("amps", "A", 1.0), ("arcmin", "rad", math.pi / 10800), ("arcsec", "rad", math.pi / 648000),
        ("mrad", "rad", 1e-3), ("radians", "rad", 1.0), ("gradians", "rad", math.pi / 200), ("Umdrehungen/min", "rad/s", math.pi / 30),
        ("MPa", "N/mm^2", 1.0), ("SFPM", "mm/s", 5.08), ("fpm", "mm/s", 5.08), ("feet", "mm", 304.8), ("percent", "", 0.01), ("kHz", "rad/s", 2e3 * math.pi),
    ],
)  # fmt: skip
def test_factors(written, unit, expected):
    assert factor(written, unit) == pytest.approx(expected, rel=1e-15)


@pytest.mark.parametrize("written", ["1/min", "min-1", "min^-1", "min⁻¹", "U/min", "rev/min", "rpm"])
def test_revolutions_a_minute(written):
    assert factor(written, "rad/s") == pytest.approx(units.rpm(1.0), rel=1e-15)


@pytest.mark.parametrize(
    ("written", "unit", "message"),
    [
        ("N", "mm", r"have a unit like mm \(nm, um, cm, m, in\); got 'N'"),
        (
            "furlong",
            "mm/s",
            r"have a unit like mm/s \(um/s, .*\); got 'furlong': 'furlong' is no unit known here",
        ),
        ("1/s", "rad/s", r"have a unit like rad/s \(deg/s, 1/min, Hz\); got '1/s'"),
        ("mm", "", r"have a unit like 1 \(none\); got 'mm'"),
        ("mil", "mm", r"'mil' may mean several units; write \"thou\" \(0.001 in\) or \"mm\""),
        ("lbs", "N", r"'lbs' may mean several units; write \"lbf\" \(a force\), or a mass in \"kg\""),
        ("grad", "rad", r"'grad' may mean several units; write \"deg\" .* or \"gon\""),
        ("NM", "N mm", "'NM' is no unit known here"),
        ("HP", "W", r"'HP' may mean several units; write \"hp\" .* or \"PS\""),
    ],
)
def test_refused_units_name_what_is_near(written, unit, message):
    with pytest.raises(ValueError, match=message):
        factor(written, unit)


def test_near_units_are_of_one_kind():
    assert near("W") == ("mW", "kW", "PS", "hp") and near("") == ()
