"""End of rapid feed: both rules, probabilities, cost, bores, files, refusals."""

import numpy as np
import pytest
from circle_inside import probability_text
from hypothesis import given
from hypothesis import strategies as st
from scipy.optimize import minimize_scalar
from scipy.stats import norm

from centering.setup import Allowance, Changeover, Stock, best_allowance

STOCK = Stock(mean=0.15, sd=0.02, roundness=0.010, roundness_sd=0.004, sigmas=3.0)
EXAMPLE = Changeover(
    STOCK, finish_radius=35.0, gap=0.010, approach_rate=0.026, largest_radius=35.16, radius_sd=0.0005
)
CYCLE = 24.66 / 1.38  # s, of the plunge cycle
LENGTHS = st.floats(0.0, 0.05)


def test_worked_example():
    assert EXAMPLE.population_position == pytest.approx(35.242, abs=1e-9)
    assert EXAMPLE.position == pytest.approx(35.1715, abs=1e-9)
    assert EXAMPLE.length_saved == pytest.approx(0.0705, abs=1e-9)
    assert (
        EXAMPLE.time_saved == pytest.approx(0.0705 / 0.026, abs=1e-7) and round(EXAMPLE.time_saved, 2) == 2.71
    )
    slower = EXAMPLE.replace(approach_rate=0.0255)
    assert round(slower.time_saved, 2) == 2.76 and round(slower.time_saved / CYCLE, 3) == 0.155


def test_worked_example_with_four_sigmas():
    wider = EXAMPLE.replace(stock=STOCK.replace(sigmas=4.0))
    assert wider.length_saved == pytest.approx(0.0945, abs=1e-9) and round(wider.time_saved, 2) == 3.63


def test_a_bore_is_the_mirror_image():
    """Radii r -> 2 finish_radius - r."""
    bore = EXAMPLE.replace(internal=True, largest_radius=70.0 - 35.16)
    assert bore.position == pytest.approx(70.0 - EXAMPLE.position, abs=1e-12)
    assert bore.population_position == pytest.approx(70.0 - EXAMPLE.population_position, abs=1e-12)
    assert bore.time_saved == pytest.approx(EXAMPLE.time_saved, rel=1e-9)
    assert bore.contact_probability == EXAMPLE.contact_probability


@pytest.mark.parametrize(
    ("sd", "oor_sd", "sigmas", "ppm"), [(0.01, 0.01, 4.24, 11), (0.02, 0.004, 3.53, 208)]
)
def test_linear_sums_are_more_than_three_sigma(sd, oor_sd, sigmas, ppm):
    change = EXAMPLE.replace(stock=STOCK.replace(sd=sd, roundness_sd=oor_sd))
    assert -norm.ppf(change.contact_probability.population) == pytest.approx(sigmas, abs=0.005)
    assert round(1e6 * change.contact_probability.population) == ppm
    assert change.replace(combine="rss").contact_probability.population == pytest.approx(
        norm.sf(3.0), rel=1e-9
    )


@pytest.mark.parametrize(("sigmas", "kept"), [(3.0, 0.998650), (4.0, 0.9999683)])
def test_the_source_claims_one_sided_sigmas(sigmas, kept):
    change = EXAMPLE.replace(stock=STOCK.replace(sigmas=sigmas), combine="rss", sigmas=sigmas)
    assert 1 - change.contact_probability.population == pytest.approx(kept, abs=5e-7)
    assert 1 - change.contact_probability.part == pytest.approx(kept, abs=5e-7)


@pytest.mark.parametrize("combine", ["linear", "rss"])
def test_probabilities_and_mean_saving_by_drawing_parts(combine):
    """A population whose rules are broken often enough to count."""
    rng, n = np.random.default_rng(7), 400_000
    stock, u, gap = STOCK.replace(sigmas=1.0), 0.003, 0.004
    height = rng.normal(stock.mean, stock.sd, n) + rng.normal(stock.roundness, stock.roundness_sd, n)
    radius = 35.0 + height
    measured = radius + rng.normal(0.0, u, n)
    change = EXAMPLE.replace(stock=stock, combine=combine, radius_sd=u, gap=gap, sigmas=1.5)
    position = measured + (change.position - change.largest_radius)
    for beyond, told in ((gap, change.contact_probability), (0.0, change.through_gap_probability)):
        for probability, limit in ((told.part, position), (told.population, change.population_position)):
            scatter = np.sqrt(probability * (1 - probability) / n)
            assert np.mean(radius > limit - beyond) == pytest.approx(probability, abs=4 * scatter + 1e-12)
    saved = (change.population_position - position) / change.approach_rate
    assert saved.mean() == pytest.approx(change.mean_time_saved, abs=4 * saved.std() / np.sqrt(n))


@given(sd=LENGTHS, oor_sd=LENGTHS, k=st.floats(0.0, 6.0))
def test_the_linear_sum_is_never_less(sd, oor_sd, k):
    stock = Stock(mean=0.1, sd=sd, roundness=0.01, roundness_sd=oor_sd, sigmas=k)
    rss, linear = stock.allowance("rss"), stock.allowance("linear")
    least = 1e-300  # mm: products of smaller numbers lose digits
    assert rss <= linear * (1 + 1e-12) + least and linear <= np.sqrt(2) * rss * (1 + 1e-12) + least


@given(u=st.floats(0.0, 0.01), gap=st.floats(0.0, 0.1), shift=st.floats(-0.1, 0.1))
def test_the_gap_is_the_same_for_both_rules(u, gap, shift):
    change = EXAMPLE.replace(radius_sd=u, gap=gap, largest_radius=35.16 + shift)
    assert change.length_saved == pytest.approx(EXAMPLE.replace(radius_sd=u).length_saved - shift, abs=1e-9)
    assert change.through_gap_probability <= change.contact_probability


def test_what_is_known_for_sure_does_not_touch():
    assert EXAMPLE.replace(radius_sd=0.0).contact_probability.part == 0.0
    sure = STOCK.replace(sd=0.0, roundness_sd=0.0)
    assert EXAMPLE.replace(stock=sure).contact_probability.population == 0.0


def test_file_picture_and_words(tmp_path):
    EXAMPLE.save(tmp_path / "changeover.nc")
    assert Changeover.from_file(tmp_path / "changeover.nc") == EXAMPLE
    data = EXAMPLE.dataset
    assert data["position"].attrs["units"] == "mm" and float(data["time_saved"]) == EXAMPLE.time_saved
    assert data["contact_probability"].attrs["long_name"].endswith("at most")
    assert float(data["contact_probability"].sel(rule="population")) == EXAMPLE.contact_probability.population
    assert (
        repr(EXAMPLE)
        == "Changeover(rapid feed to 35.1715 mm, 70.5 µm beyond the population's 35.2420 mm: 2.71 s of air saved)"
    )
    out = EXAMPLE.replace(largest_radius=35.25)
    assert out.outside_population and not EXAMPLE.outside_population
    assert repr(out).endswith(
        "19.5 µm short of the population's 35.2420 mm: 0.75 s more of air, and no crash)"
    )


def test_picture(tmp_path):
    pyplot = pytest.importorskip("matplotlib.pyplot")
    pyplot.switch_backend("agg")
    (axis,) = EXAMPLE.plot().axes
    dashed = sorted(line.get_xdata()[0] for line in axis.lines if line.get_linestyle() == "--")
    assert dashed == [EXAMPLE.position, EXAMPLE.population_position]
    assert axis.get_title().startswith(
        "saved 70.5 µm = 2.71 s of air; contact of the population's rule: 208 ppm"
    )
    assert axis.get_legend().get_texts()[1].get_text() == "this part, ± 3 sd: beyond in 0.135 % at most"
    assert EXAMPLE.replace(internal=True, largest_radius=34.84).plot(axis) is axis.figure


@pytest.mark.parametrize(
    ("probability", "said"),
    [
        (0.0, "0 ppm"),
        (2.0798e-4, "208 ppm"),
        (9.994e-4, "999 ppm"),
        (9.996e-4, "0.1 %"),
        (0.0102, "1.02 %"),
        (1.0, "100 %"),
    ],
)
def test_chances_have_three_digits(probability, said):
    assert probability_text(probability) == said


def test_allowance_of_least_cost():
    best = best_allowance(np.hypot(0.02, 0.004), approach_rate=0.026, crash_time=300.0)
    assert best.sigmas == pytest.approx(3.17099, abs=5e-6)
    assert best.cost(3.0) > best.cost() < best.cost(3.4)


@given(sd=st.floats(1e-4, 0.1), rate=st.floats(0.005, 1.0), crash=st.floats(0.1, 1e5))
def test_no_other_allowance_costs_less(sd, rate, crash):
    best = best_allowance(sd, approach_rate=rate, crash_time=crash)
    found = minimize_scalar(best.cost, bounds=(0.0, 12.0), method="bounded", options={"xatol": 1e-9})
    assert best.cost() <= min(found.fun, best.cost(0.0)) * (1 + 1e-12)
    if best.sigmas > 0:
        assert best.marginal_cost() == pytest.approx(0.0, abs=1e-9 * (sd / rate))
    else:
        assert best.marginal_cost() >= 0.0


@given(sd=st.floats(1e-3, 0.1), crash=st.floats(10.0, 1e4), z=st.floats(0.0, 6.0))
def test_marginal_cost_is_the_slope_of_the_cost(sd, crash, z):
    best, step = best_allowance(sd, approach_rate=0.03, crash_time=crash), 1e-5
    slope = (best.cost(z + step) - best.cost(z - step)) / (2 * step)
    assert best.marginal_cost(z) == pytest.approx(slope, abs=1e-8 * (sd / 0.03 + crash))


def test_a_changeover_by_cost():
    change = EXAMPLE.replace(crash_time=300.0)
    assert change.part_sigmas == pytest.approx(
        best_allowance(0.0005, approach_rate=0.026, crash_time=300.0).sigmas
    )
    assert change.position > EXAMPLE.position
    assert EXAMPLE.replace(radius_sd=0.0, crash_time=300.0).part_sigmas == 0.0


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"gap": 10.0}, r"gap must be < 3; units.um\(...\) for micrometres \(mm\); got 10.0"),
        ({"gap": -0.01}, r"gap must be >= 0 \(mm\); got -0.01"),
        ({"approach_rate": 0.0}, r"approach_rate must be > 0 \(mm/s\); got 0.0"),
        ({"approach_rate": -1.0}, r"approach_rate must be > 0 \(mm/s\); got -1.0"),
        ({"radius_sd": -1e-4}, r"radius_sd must be >= 0 \(mm\); got -0.0001"),
        ({"finish_radius": 0.0}, r"finish_radius must be > 0 \(mm\); got 0.0"),
        ({"largest_radius": float("nan")}, r"largest_radius must be finite \(mm\); got nan"),
        ({"combine": "sum"}, r"combine must be one of linear, rss; got 'sum'"),
        ({"sigmas": 3.0, "crash_time": 10.0}, r"sigmas must be left out where crash_time is given"),
        ({"sigmas": -1.0}, r"sigmas must be >= 0; got -1.0"),
        ({"crash_time": 0.0}, r"crash_time must be > 0 \(s\); got 0.0"),
    ],
)
def test_refusals(changes, said):
    with pytest.raises(ValueError, match=said):
        EXAMPLE.replace(**changes)


@pytest.mark.parametrize("name", ["mean", "sd", "roundness", "roundness_sd"])
def test_a_population_of_negative_numbers_is_refused(name):
    with pytest.raises(ValueError, match=rf"^{name} must be >= 0 \(mm\); got -0.01$"):
        STOCK.replace(**{name: -0.01})


@pytest.mark.parametrize(
    ("name", "value"), [("mean", 150.0), ("sd", 20.0), ("roundness", 10.0), ("roundness_sd", 4.0)]
)
def test_micrometres_are_refused(name, value):
    with pytest.raises(
        ValueError, match=rf"^{name} must be < (10|3); units.um\(...\) for micrometres \(mm\); got {value}$"
    ):
        STOCK.replace(**{name: value})


def test_other_refusals():
    with pytest.raises(ValueError, match=r"sd must be > 0 \(mm\); got 0.0"):
        best_allowance(0.0, approach_rate=0.026, crash_time=300.0)
    with pytest.raises(TypeError, match=r"stock must be a Stock; got 0\.15"):
        EXAMPLE.replace(stock=0.15)
    with pytest.raises(ValueError, match="Stock has no field 'oor'"):
        STOCK.replace(oor=0.1)
    assert isinstance(best_allowance(0.02, approach_rate=0.026, crash_time=300.0), Allowance)
