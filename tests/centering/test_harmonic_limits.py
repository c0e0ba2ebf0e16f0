"""Harmonics against limits, directions of crests, tables."""

import numpy as np
import pytest
from measured_rings import form, turn

from centering.roundness import Harmonics, Profile
from sdpgrind import units
from sdpgrind.base.stored import decode, encode

LOBES = {3: (4e-4, 1.0), 12: (3e-4, -2.0), 42: (8e-5, 3.0)}
ANGLE = turn(1, 1024)


def ring(noise=0.0, rng=0):
    return Profile(40.0 + form(ANGLE, LOBES) + noise * np.random.default_rng(rng).normal(size=ANGLE.size))


def test_crests_are_where_the_wave_is_highest():
    found = ring().harmonics(60)
    fine = np.linspace(0, 2 * np.pi, 200_000, endpoint=False)
    for upr in LOBES:
        crest = found.crest[upr - 1]
        within = fine[fine < 2 * np.pi / upr]
        highest = within[np.argmax(np.cos(upr * within - found.phase[upr - 1]))]
        assert abs(np.angle(np.exp(1j * upr * (crest - highest)))) < upr * 2e-5
    random = Harmonics(np.arange(1.0, 2001), np.ones(2000), np.random.default_rng(0).uniform(-9, 9, 2000))
    assert np.all((random.crest >= 0) & (random.crest < 2 * np.pi / random.upr))
    assert Harmonics([3.0], [1.0], [-1e-17]).crest[0] < 2 * np.pi / 3  # a hair below 0 is no full turn


def test_what_is_above_a_limit():
    found = ring().harmonics(60, limits={(2, 15): units.um(0.35), 12: units.um(0.2), 42: units.um(0.1)})
    assert [(row.upr, row.limit) for row in found.exceeds] == [(3, 3.5e-4), (12, 2e-4)]
    assert [row.size for row in found.exceeds] == pytest.approx([4e-4, 3e-4], abs=1e-12)
    assert "; 2 above their limits)" in repr(found) and "above" not in repr(ring().harmonics(60))


def test_ranges_are_twice_the_amplitude():
    limits = {42: units.um(0.1)}
    assert not ring().harmonics(60, limits=limits).exceeds
    found = ring().harmonics(60, limits=limits, as_range=True)
    ((upr, size, limit, _),) = found.exceeds
    assert (upr, limit) == (42, 1e-4) and size == pytest.approx(1.6e-4, abs=1e-12)
    table = found.to_dataframe()
    assert table.loc[42, "range"] == pytest.approx(1.6e-4) and table.loc[42, "limit"] == 1e-4
    assert np.isnan(table.loc[41, "limit"]) and found.amplitude[41] == pytest.approx(8e-5)


def test_the_excess_is_told_in_standard_deviations():
    """At a limit of the true amplitude the excess is normal about 0: |z| > 2 in some 5 %, above it in a half."""
    found = [ring(1e-4, rng).harmonics(60, limits={42: 8e-5}) for rng in range(160)]
    above = [row.z for each in found for row in each.exceeds]
    assert len(above) == pytest.approx(80, abs=2 * 6)  # two sd of a binomial
    assert np.sum(np.array(above) > 2) == pytest.approx(160 * 0.0228, abs=2 * 1.8)
    half, full = (ring(noise).harmonics(60, limits={42: 5e-5}).exceeds[0].z for noise in (2e-4, 1e-4))
    assert 1 < half < full


def test_tables_and_files():
    profile = ring()
    found = profile.harmonics(60, limits={(2, 15): 5e-4})
    assert decode(encode(found)) == found and decode(encode(found)).limits == ((2, 15, 5e-4),)
    table = profile.to_dataframe()
    assert list(table.columns) == ["angle", "reading", "deviation"] and len(table) == 1024
    assert np.array_equal(table["deviation"], profile.deviation)
    assert found.to_dataframe()["amplitude"].to_numpy() == pytest.approx(found.amplitude)


def test_limits_are_drawn():
    axis = ring().harmonics(60, limits={(2, 15): 5e-4}).plot().axes[0]
    (band,) = [
        each.get_segments()[0]
        for each in axis.collections
        if len(each.get_paths()) == 1 and hasattr(each, "get_segments")
    ]
    assert band == pytest.approx(np.array([[1.6, 0.5], [15.4, 0.5]]))


@pytest.mark.parametrize(
    ("limits", "said"),
    [
        ({90: 1e-4}, r"harmonics that were measured, those up to 60 upr; got one of 90 upr"),
        ({(2, 80): 1e-4}, r"got one of 61 upr: give upr_max=80"),
        ({1: 1e-4}, r"limits must be of a harmonic from 2 upr on, or of a band \(low, high\); got 1"),
        ({(15, 2): 1e-4}, r"or of a band \(low, high\); got \(15, 2\)"),
        ({2.5: 1e-4}, r"limits must be of a harmonic from 2 upr on"),
        ({3: 0.5}, r"limits\[3\] must be in mm, some 0.0005; units.um\(...\) for micrometres; got 0.5"),
        ({3: 0.0}, r"limits\[3\] must be > 0 \(mm\)"),
    ],
)
def test_limits_that_are_refused(limits, said):
    with pytest.raises(ValueError, match=said):
        ring().harmonics(60, limits=limits)


def test_limits_after_a_filter_warn():
    """The Gaussian leaves exp2(-(42/50)^2) = 0.613 of 42 upr, below a limit that the part exceeds."""
    with pytest.warns(UserWarning, match="after a Gaussian low-pass, 50 upr, which lowers harmonics"):
        found = ring().filter(upr=50).harmonics(limits={42: 6e-5})
    assert not found.exceeds and ring().harmonics(60, limits={42: 6e-5}).exceeds


def test_limits_that_are_no_mapping():
    with pytest.raises(TypeError, match=r"limits must be a mapping as \{\(2, 15\): units\.um\(0\.5\)"):
        ring().harmonics(60, limits=[0.5])


def test_the_page_holds_harmonics_against_limits():
    """3 and 42 upr with an sd of 1e-4 mm sqrt(2/1024), 4.4 nm: 8.7 nm for 95 %."""
    told = ring(1e-4).report(limits={"RONt": 0.003, (2, 15): 2e-4, 3: 5e-4, 42: 8.1e-5})
    assert "RONt (LSC) " in told and "limit 3 µm: accepted" in told
    assert (
        "2 to 15 upr: largest amplitude at 3 upr 0.4" in told and "limit 0.2 µm, 2 above it: rejected" in told
    )
    assert "3 upr: amplitude 0.4" in told and "µm (95 %), limit 0.5 µm: accepted" in told
    assert "42 upr: amplitude 0.0" in told and "limit 0.081 µm: not decided" in told


def test_each_limit_counts_its_own_band():
    told = ring(1e-6).report(limits={(2, 5): 1e-4, (2, 15): 1e-4})
    assert "2 to 5 upr: largest amplitude at 3 upr" in told and told.count(", 2 above it") == 1
    assert told.count("above it") == 1


def test_limits_as_a_file_holds_them_are_checked():
    with pytest.raises(ValueError, match="limits"):
        ring().harmonics(60, limits=((2, 3, -5.0),))
