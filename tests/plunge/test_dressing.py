"""Roughness law and dressing lead: inverse and forward, by hand, as printed."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from sdpgrind import plunge, units
from sdpgrind.base import stored

LAW = plunge.RoughnessLaw()
WORK = {"work_diameter": 70.0, "wheel_speed": units.m_per_s(37.0)}
CUT = WORK | {"dressing_depth": 0.01, "infeed_rate": 0.0255}


def test_the_published_wheel():
    """R_a 0.7 um, a_d 0.01 mm at 0.0255 mm/s: 0.0999 mm a turn; by hand with logarithms."""
    lead = LAW.dressing_lead(units.um(0.7), **CUT)
    assert lead == pytest.approx(0.0999, abs=5e-5)
    assert lead == pytest.approx(
        (0.7 / 98.0 * (37e3 / (3.14159265 * 70.0 * 0.0255)) ** 0.3 * 100.0**0.25) ** 2, rel=1e-8
    )


def test_as_printed_the_lead_vanishes():
    """(10) has a_d^(1/y): 1e-8 in place of 3.16, squared."""
    printed = LAW.dressing_lead(units.um(0.7), **CUT, method="printed")
    assert printed == pytest.approx(1e-18, rel=0.01)
    assert printed == pytest.approx(
        LAW.dressing_lead(units.um(0.7), **CUT) * (0.01**4 / 0.01**-0.25) ** 2, rel=1e-9
    )


share = st.floats(0.1, 2.0)


@given(
    lead=st.floats(1e-3, 1.0), depth=st.floats(1e-3, 0.1), rate=st.floats(1e-3, 0.1), scale=st.floats(0.01, 1.0),
    exponents=st.tuples(share, share, share),
)  # fmt: skip
def test_forward_and_back(lead, depth, rate, scale, exponents):
    law = plunge.RoughnessLaw(scale, *exponents)
    at = WORK | {"dressing_depth": depth, "infeed_rate": rate}
    assert law.dressing_lead(law.roughness(lead, **at), **at) == pytest.approx(lead, rel=1e-9)
    assert law.roughness(2 * lead, **at) == pytest.approx(2 ** exponents[0] * law.roughness(lead, **at))
    deeper, faster = at | {"dressing_depth": 2 * depth}, at | {"infeed_rate": 2 * rate}
    assert law.roughness(lead, **deeper) > law.roughness(lead, **at) < law.roughness(lead, **faster)


def test_the_greatest_rate_is_the_safe_one():
    lead = LAW.dressing_lead(units.um(0.7), **CUT)
    assert LAW.roughness(lead, **(CUT | {"infeed_rate": 0.005})) < units.um(0.7)


def test_it_can_be_stored():
    law = LAW.replace(roughness_scale=0.05)
    assert stored.decode(stored.encode(law)) == law


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: plunge.RoughnessLaw(roughness_scale=0.0), r"roughness_scale must be > 0 \(mm\); got 0.0"),
        (lambda: plunge.RoughnessLaw(lead_exponent=-1.0), "lead_exponent must be > 0; got -1.0"),
        (lambda: LAW.dressing_lead(-1.0, **CUT), r"roughness must be > 0 \(mm\); got -1.0"),
        (
            lambda: LAW.roughness(0.1, **(CUT | {"dressing_depth": 0.0})),
            r"dressing_depth must be > 0 \(mm\); got 0.0",
        ),
        (
            lambda: LAW.roughness(0.1, **(CUT | {"infeed_rate": 0.0})),
            r"infeed_rate must be > 0 \(mm/s\); got 0.0",
        ),
        (
            lambda: LAW.dressing_lead(1e-3, **CUT, method="exact"),
            "method must be one of solved, printed; got 'exact'",
        ),
    ],
)
def test_messages(call, message):
    with pytest.raises(ValueError, match=message):
        call()
