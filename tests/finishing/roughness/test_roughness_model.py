"""The law of roughness: its numbers from Table 2, leaving out, laws, rounding, the way back from data."""

import numpy as np
import pytest
from finishing_inside import identify_roughness, left_out
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import integrate, stats

from sdpgrind import finishing as fin
from sdpgrind import sdp, units
from sdpgrind.base.stored import decode, encode
from sdpgrind.finishing.roughness import leave_one_out

STUDY = fin.Study.published("wang-2001")
MODEL = fin.roughness.RoughnessModel.published()
AT = {"pattern": "hilbert5", "tool_diameter": 4.0, "normal_force": 1.111}
GIVEN = [1.865764, -0.473250, -0.158149, -0.902040, -0.154618, 0.489693]


def table_two():
    """Columns straight from the settings: intercept, two patterns, ln d/3.5, ln F/1.111 and its square, ln
    feed/25; ln R_a.
    """
    s = STUDY.settings
    x = np.log(s["normal_force"] / 1.111)
    marks = [s["pattern"] == name for name in ("hilbert5", "zigzag")]
    columns = [np.ones(18), *marks, np.log(s["tool_diameter"] / 3.5), x, x**2, np.log(s["feed_rate"] / 25)]
    return np.column_stack(columns).astype(float), np.log(1e3 * STUDY.readings[:, 0])


def test_coefficients_by_least_squares():
    rows, y = table_two()
    beta, (square,), *_ = np.linalg.lstsq(rows[:, :6], y, rcond=None)
    np.testing.assert_allclose(MODEL.coefficients, beta, atol=1e-12)
    np.testing.assert_allclose(beta, GIVEN, atol=1e-5)
    assert MODEL.residual_sd == pytest.approx(np.sqrt(square / 12), rel=1e-10)
    assert MODEL.residual_sd == pytest.approx(0.06737, abs=1e-5)
    assert MODEL.freedom == 12
    covariance = np.linalg.inv(rows[:, :6].T @ rows[:, :6]) * square / 12
    np.testing.assert_allclose(MODEL.covariance, covariance, atol=1e-12)
    np.testing.assert_allclose(
        MODEL.standard_errors, [0.0355, 0.0389, 0.0389, 0.1104, 0.0532, 0.1213], atol=5.1e-5
    )


def test_no_feed_term():
    rows, y = table_two()
    beta, (square,), *_ = np.linalg.lstsq(rows, y, rcond=None)
    error = np.sqrt(np.linalg.inv(rows.T @ rows)[6, 6] * square / 11)
    assert 2 * stats.t.sf(abs(beta[6]) / error, 11) == pytest.approx(0.31, abs=5e-3)


def slowly_left_out(rows, y):
    """One run after the other left out and predicted."""
    guess = [
        float(rows[k] @ np.linalg.lstsq(np.delete(rows, k, 0), np.delete(y, k), rcond=None)[0])
        for k in range(y.size)
    ]
    return np.exp(y), np.exp(guess)


def test_leaving_out_one_run():
    found = leave_one_out(STUDY)
    rows, y = table_two()
    read, guess = slowly_left_out(rows[:, :6], y)
    log_error, error = np.log(read / guess), read - guess
    assert found.q_squared == pytest.approx(1 - np.sum(log_error**2) / np.sum((y - y.mean()) ** 2), rel=1e-10)
    assert found.rms_log == pytest.approx(np.sqrt(np.mean(log_error**2)), rel=1e-10)
    assert 1e3 * found.rms == pytest.approx(np.sqrt(np.mean(error**2)), rel=1e-10)
    assert found.mean_error == pytest.approx(np.mean(np.abs(error) / guess), rel=1e-10)
    assert found.worst_error == pytest.approx(np.max(np.abs(error) / guess), rel=1e-10)
    assert found.worst_of_reading == pytest.approx(np.max(np.abs(error) / read), rel=1e-10)
    assert found.q_squared == pytest.approx(0.918, abs=5e-4)
    assert found.rms_log == pytest.approx(0.0825, abs=5e-5)
    assert 1e3 * found.rms == pytest.approx(0.481, abs=5e-4)
    assert 100 * found.mean_error == pytest.approx(6.3, abs=0.05)
    assert 100 * found.worst_error == pytest.approx(19.0, abs=0.05)
    assert 100 * found.worst_of_reading == pytest.approx(23.4, abs=0.05)
    assert 100 * np.mean(np.abs(error) / read) == pytest.approx(6.5, abs=0.05)


def test_other_models_predict_worse():
    rows, y = table_two()
    linear, feed = left_out(rows[:, :5], y), left_out(rows, y)
    assert 1e3 * linear.rms == pytest.approx(0.645, abs=6e-4)
    assert 1e3 * feed.rms == pytest.approx(0.527, abs=6e-4)
    assert 1e3 * left_out(rows[:, :1], y).rms == pytest.approx(1.919, abs=6e-4)


def test_the_law_has_the_right_mean_and_sd():
    """Moments by integrating the density of a log-normal law of that median and residual."""
    law, median, s = MODEL.law(**AT), float(MODEL.median(**AT)), MODEL.residual_sd
    assert 1e3 * median == pytest.approx(3.568, abs=1e-3)
    moment = [
        integrate.quad(lambda z, k=k: (median * np.exp(s * z)) ** k * stats.norm.pdf(z), -12, 12)[0]
        for k in (1, 2)
    ]
    assert float(law.mean) == pytest.approx(moment[0], rel=1e-9)
    assert float(law.sd) == pytest.approx(np.sqrt(moment[1] - moment[0] ** 2), rel=1e-6)
    assert float(law.mean) > median
    assert float(law.over(median, power=0)) == pytest.approx(0.5, abs=1e-12)


def test_uncertain_laws_scatter_more_by_what_the_data_leave_open():
    rows, y = table_two()
    x = np.array([1, 1, 0, np.log(4 / 3.5), 0, 0])
    square = np.linalg.lstsq(rows[:, :6], y, rcond=None)[1][0] / 12
    wanted = np.sqrt(square * (1 + x @ np.linalg.inv(rows[:, :6].T @ rows[:, :6]) @ x))
    law = MODEL.law(**AT, uncertain=True)
    assert np.sqrt(np.log1p((float(law.sd) / float(law.mean)) ** 2)) == pytest.approx(wanted, rel=1e-9)


def test_laws_broadcast():
    law = MODEL.law(np.array(["hilbert4", "zigzag"])[:, None], 3.5, np.array([0.6, 1.0, 1.6]))
    assert law.shape == (2, 3)
    assert float(law.mean[1, 2]) == pytest.approx(float(MODEL.law("zigzag", 3.5, 1.6).mean), rel=1e-14)


def test_best_force():
    assert MODEL.best_force() == pytest.approx(1.301, abs=1e-3)
    forces = np.linspace(0.556, 1.667, 20001)
    least = forces[np.argmin(MODEL.median("zigzag", 3.2, forces))]
    assert MODEL.best_force() == pytest.approx(least, abs=1e-4)
    bowl = np.array(MODEL.coefficients)
    assert MODEL.replace(coefficients=bowl * [1, 1, 1, 1, 1, -1]).best_force() in (0.556, 1.667)
    assert MODEL.replace(normal_force_range=(0.5, 1.0)).best_force() == pytest.approx(1.0)


def test_samples_follow_the_law():
    drawn = MODEL.sample(**AT, rng=0, size=20000)
    law = MODEL.law(**AT)
    ks = stats.kstest(drawn, lambda y: law.under(y, 0))
    assert ks.pvalue > 1e-3
    assert MODEL.sample(**AT, rng=0, size=3).tolist() == drawn[:3].tolist()


def test_rounded_samples_are_multiples():
    step = units.um(0.25)
    drawn = MODEL.sample(**AT, rng=1, size=5000, rounding=step)
    np.testing.assert_allclose(drawn / step, np.round(drawn / step), atol=1e-9)
    plain = MODEL.sample(**AT, rng=1, size=5000)
    assert np.max(np.abs(drawn - plain)) <= step / 2 * (1 + 1e-9)
    assert np.min(MODEL.sample(**AT, rng=1, size=10, rounding=1.0)) == 1.0


def test_from_drawn_data_back_to_the_model():
    rng = np.random.default_rng(11)
    n = 3000
    data = {
        "pattern": rng.choice(["hilbert4", "hilbert5", "zigzag"], n),
        "tool_diameter": rng.uniform(3, 4, n),
        "normal_force": rng.uniform(0.556, 1.667, n),
    }
    data["roughness_ra"] = MODEL.sample(*data.values(), rng=rng)
    estimate = identify_roughness(data)
    wanted = np.append(MODEL.coefficients, MODEL.residual_sd)
    assert np.all(np.abs(estimate.value - wanted) < 4 * estimate.sd)
    assert estimate.freedom == n - 6
    updated = MODEL.updated(estimate)
    assert updated.residual_sd == estimate["residual_sd"] and updated.freedom == n - 6
    assert updated.tool_diameter_range == MODEL.tool_diameter_range
    assert fin.identify(data, "roughness").value.tolist() == estimate.value.tolist()


def test_the_published_study_gives_the_published_model():
    assert MODEL.updated(identify_roughness(STUDY)) == MODEL


def test_replicates_count_as_readings():
    twice = fin.Study("L18", STUDY.factors, np.repeat(STUDY.readings, 2, axis=1), unit="mm", reference=0.01)
    estimate = identify_roughness(twice)
    np.testing.assert_allclose(estimate.value[:6], MODEL.coefficients, rtol=1e-9)
    assert estimate.freedom == 30


def test_saved_and_loaded():
    assert decode(encode(MODEL)) == MODEL
    assert hash(decode(encode(MODEL))) == hash(MODEL)


@settings(max_examples=50, deadline=None)
@given(st.sampled_from(["hilbert4", "hilbert5", "zigzag"]), st.floats(3.0, 4.0), st.floats(0.556, 1.667))
def test_relative_scatter_is_the_same_everywhere(pattern, diameter, force):
    law = MODEL.law(pattern, diameter, force)
    assert isinstance(law, sdp.LogNormal)
    assert float(law.sd / law.mean) == pytest.approx(np.sqrt(np.expm1(MODEL.residual_sd**2)), rel=1e-9)


def of_one_pattern(roughness):
    settings = {"pattern": ["zigzag"] * 8, "tool_diameter": [4.0] * 8, "normal_force": [1.0] * 8}
    return settings | {"roughness_ra": [roughness] * 8}


REFUSED = [
    (
        lambda: MODEL.law("spiral", 4.0, 1.0),
        r"pattern must be one of hilbert4, hilbert5, zigzag; got 'spiral'",
    ),
    (
        lambda: MODEL.law(["zigzag", None], 4.0, 1.0),
        r"pattern must be one of hilbert4, hilbert5, zigzag; got None",
    ),
    (lambda: MODEL.law(3.0, 4.0, 1.0), r"pattern must be one of hilbert4, hilbert5, zigzag; got 3.0"),
    (
        lambda: MODEL.law([["zigzag"], ["zigzag", "a"]], 4.0, 1.0),
        r"pattern must be one of hilbert4, .*; got \['zigzag'\]",
    ),
    (
        lambda: MODEL.replace(covariance=-np.eye(6)),
        r"covariance must be positive semidefinite, no eigenvalue below 0 .*got -1",
    ),
    (
        lambda: MODEL.replace(covariance=np.triu(np.ones((6, 6)))),
        r"covariance must be symmetric \(1\); got 1 at \[0, 1\], 0 at",
    ),
    (
        lambda: MODEL.law("zigzag", 4.5, 1.0),
        r"tool_diameter must be in \[3, 4\], where the model is known, .* \(mm\); got 4.5",
    ),
    (
        lambda: MODEL.law("zigzag", 4.0, 0.5),
        r"normal_force must be in \[0.556, 1.667\], where .* \(N\); got 0.5",
    ),
    (lambda: MODEL.law("zigzag", 4.0, -1.0, extrapolate=True), r"normal_force must be > 0 \(N\); got -1.0"),
    (lambda: MODEL.law("zigzag", np.nan, 1.0), r"tool_diameter\[0\] must be finite \(mm\)"),
    (lambda: MODEL.sample(**AT, rng=0, rounding=0.0), r"rounding must be > 0 \(mm\); got 0.0"),
    (lambda: MODEL.replace(residual_sd=-1.0), r"residual_sd must be >= 0"),
    (lambda: MODEL.replace(coefficients=[1.0]), r"coefficients must be of shape \(6,\); got \(1,\)"),
    (
        lambda: MODEL.replace(normal_force_range=(2.0, 1.0)),
        r"normal_force_range must be two numbers, 0 < low < high \(N\)",
    ),
    (lambda: MODEL.updated(3), r"estimate must be an Estimate, as finishing.identify gives it; got 3"),
    (
        lambda: MODEL.responses({"feed_rate": [1.0]}, rng=0, runs=1),
        r"settings must hold pattern; got feed_rate",
    ),
    (
        lambda: identify_roughness({"pattern": ["zigzag"]}),
        r"data must hold tool_diameter \(mm\); it holds pattern",
    ),
    (lambda: identify_roughness([1.0]), r"data must be a Study, arrays by name or a log; got"),
    (
        lambda: identify_roughness(of_one_pattern(5.0)),
        r"roughness_ra must be in \(0, 1\); units.um\(...\) for micrometres \(mm\); got 5.0",
    ),
    (
        lambda: fin.identify(of_one_pattern(5e-3), "roughness"),
        r"the data do not determine all values: .*; no reading is of the pattern hilbert\d, ",
    ),
    (
        lambda: identify_roughness({name: values[:6] for name, values in of_one_pattern(5e-3).items()}),
        r"data must hold 7 readings or more for 6 coefficients; got 6",
    ),
    (
        lambda: identify_roughness(of_one_pattern(5e-3) | {"tool_diameter": [4.0]}),
        r"tool_diameter must have 8 entries, as pattern has; got 1",
    ),
    (
        lambda: identify_roughness(fin.Study("L4", {"a": (0, 1)}, [1.0, 2.0, 3.0, 4.0], unit="V")),
        r"the study must be of readings in mm; got the unit 'V'",
    ),
]


@pytest.mark.parametrize(("call", "message"), REFUSED)
def test_refusals(call, message):
    with pytest.raises((ValueError, TypeError), match=message):
        call()


@settings(max_examples=100, deadline=None)
@given(
    st.sampled_from(["hilbert4", "zigzag", "spiral"]),
    st.floats(-1.0, 6.0) | st.just(np.nan),
    st.floats(-1.0, 3.0),
)
def test_what_is_covered_needs_no_extrapolation(pattern, diameter, force):
    try:
        MODEL.law(pattern, diameter, force)
    except ValueError:
        assert not MODEL.covers(pattern, diameter, force)
    else:
        assert MODEL.covers(pattern, diameter, force)


def test_the_ends_of_the_ranges_are_covered():
    ends = np.array(MODEL.normal_force_range)
    assert MODEL.covers("hilbert5", 3.0, ends) and MODEL.covers(["hilbert4", "zigzag"], 4.0, ends)
    assert not MODEL.covers("hilbert5", 3.0, ends * [1.0, 1.001]) and not MODEL.covers(
        ["hilbert4", "spiral"], 4.0, ends
    )


def test_outside_on_request():
    assert float(MODEL.law("zigzag", 5.0, 2.0, extrapolate=True).mean) > 0


def test_what_does_not_determine_the_model_is_told():
    estimate = fin.identify(of_one_pattern(5e-3), "roughness", throw=False)
    assert not estimate.ok and not np.any(np.isnan(estimate.value))
    with pytest.raises(ValueError, match="estimate must have succeeded"):
        MODEL.updated(estimate)


def test_coefficients_without_doubt_are_a_model():
    sure = MODEL.replace(covariance=np.zeros((6, 6)))
    assert float(sure.law("zigzag", 4.0, 1.0, uncertain=True).sd) == pytest.approx(
        float(sure.law("zigzag", 4.0, 1.0).sd)
    )
    assert MODEL.replace(covariance=np.ones((6, 6))).standard_errors.tolist() == [1.0] * 6  # of rank one


def test_patterns_come_as_they_like():
    wanted = MODEL.median("zigzag", 4.0, 1.0)
    for names in (
        ["zigzag"],
        ("zigzag",),
        np.array(["zigzag"]),
        np.array(["zigzag"], dtype=object),
        np.str_("zigzag"),
    ):
        assert np.ravel(MODEL.median(names, 4.0, 1.0)).tolist() == [wanted]
