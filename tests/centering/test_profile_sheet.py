"""Page of a profile: the circle that a drawing asks for, undulations that count, none of noise alone."""

import re

import numpy as np
import pytest

import centering

ANGLE = np.radians(np.arange(0.0, 360.0, 0.5))


def ring(seed=1, lobes=8e-4):
    noise = 5e-5 * np.random.default_rng(seed).normal(size=ANGLE.size)
    return centering.Profile(ANGLE, 40.0 + lobes * np.cos(3 * ANGLE) + lobes * np.cos(24 * ANGLE) + noise)


@pytest.mark.parametrize("kind", ["LSC", "MZC", "MCC", "MIC"])
def test_a_limit_is_held_against_the_circle_that_is_named(kind):
    profile = ring()
    told = profile.report(limits={f"RONt ({kind})": 0.01, f"RONq ({kind})": 1e-4})
    value = 1e3 * profile.roundness(kind).value
    ends = " (" if kind in ("LSC", "MZC") else "; "
    assert f"RONt ({kind}) {value:.4g} µm as measured{ends}" in told
    found = (
        "accepted" if kind in ("LSC", "MZC") else f"not decided, no interval of RONt is proved about {kind}"
    )
    assert f"limit 10 µm: {found}" in told
    assert re.search(rf"^RONq \({kind}\) .* limit 0.1 µm: not decided, above the", told, re.M)


def test_a_limit_without_a_circle_is_of_least_squares():
    profile = ring()
    assert "RONt (LSC) " in profile.report(limits={"RONt": 0.01})
    with pytest.raises(ValueError, match=r"limits must be one of .*; got 'RONt \(LSQ\)'"):
        profile.report(limits={"RONt (LSQ)": 0.01})


def test_the_page_says_which_undulations_count():
    profile = ring()
    assert "not filtered: all undulations; profile.filter(upr=50)" in profile.report()
    assert "filtered: Gaussian low-pass, 15 upr" in profile.filter(upr=15).report()


def test_noise_is_no_undulation_of_the_table():
    told = ring().report()
    table = told[told.index("Largest undulations") : told.index("[picture")]
    assert [int(upr) for upr in re.findall(r"^(\d+) ", table, re.M)] in ([3, 24], [24, 3])
    named = [text.get_text() for text in ring().harmonics().plot().axes[0].texts]
    assert sorted(named) == ["24", "3"]
    alone = ["No undulation is above the noise" in ring(seed, lobes=0.0).report() for seed in range(20)]
    assert np.mean(alone) > 0.7
