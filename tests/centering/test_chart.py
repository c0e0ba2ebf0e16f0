"""Control charts: limits, signals against plain loops, counted false alarms, summary, refusals."""

import json
from itertools import pairwise

import numpy as np
import pytest
from circle_inside import ewma_run_length

import sdpgrind
from centering.monitoring import ControlChart

RNG = np.random.default_rng(1)
BATCH = {"roundness": 0.010 + 0.001 * RNG.standard_normal(60), "stock": 0.15 + 0.02 * RNG.standard_normal(60)}


def chart(**options):
    return ControlChart(BATCH, **options)


def test_limits_are_those_of_moving_ranges():
    limits, values = chart().limits["stock"], BATCH["stock"]
    mean_range = np.mean([abs(b - a) for a, b in pairwise(values)])
    assert limits.mean == pytest.approx(values.mean()) and limits.sd == pytest.approx(
        mean_range / 1.128379, rel=1e-6
    )
    assert limits.high - limits.mean == pytest.approx(2.66 * mean_range, rel=1e-3)  # the factor of the books
    assert limits.mean - limits.low == pytest.approx(limits.high - limits.mean)
    assert limits.range_high == pytest.approx(3.76 * mean_range, rel=1e-3)
    assert limits.average_high - limits.mean == pytest.approx(3 * limits.sd * np.sqrt(0.2 / 1.8))


def test_a_slow_change_in_the_batch_does_not_widen_the_limits():
    values = BATCH["stock"]
    drifting = values + np.linspace(0, 0.2, 60)
    sd = ControlChart({"stock": drifting}).limits["stock"].sd
    assert sd == pytest.approx(chart().limits["stock"].sd, rel=0.05) and sd < 0.5 * np.std(drifting)


def test_signals_are_those_of_a_plain_loop():
    rng, made, sigmas, weight = np.random.default_rng(2), chart(sigmas=2.0, weight=0.3), 2.0, 0.3
    limits = made.limits["stock"]
    values = 0.16 + 0.02 * rng.standard_normal(300)
    wanted, average, last = [], limits.mean, None
    for part, value in enumerate(values):
        average = (1 - weight) * average + weight * value
        away = [abs(value - limits.mean) / limits.sd > sigmas]
        away.append(last is not None and abs(value - last) / limits.sd > sigmas * np.sqrt(2))
        away.append(abs(average - limits.mean) / limits.sd > sigmas * np.sqrt(weight / (2 - weight)))
        wanted += [(part, rule) for rule, out in zip(("value", "range", "average"), away, strict=True) if out]
        last = value
        made.update(stock=value)
    assert [(signal.part, signal.rule) for signal in made.signals] == wanted
    assert {rule for _, rule in wanted} == {"value", "range", "average"}


def first_alarms(runs, rng, sigmas=3.0, weight=0.2):
    """Parts until the first signal with exact limits; the three charts in plain steps on many rows."""
    average, last, parts, left = (
        np.zeros(runs),
        np.full(runs, np.nan),
        np.zeros(runs),
        np.ones(runs, dtype=bool),
    )
    for part in range(1, 5000):
        value = rng.standard_normal(runs)
        average += weight * (value - average)
        out = (abs(value) > sigmas) | (abs(value - last) > np.sqrt(2) * sigmas)
        out |= abs(average) > sigmas * np.sqrt(weight / (2 - weight))
        last = value
        parts[left & out] = part
        left &= ~out
        if not left.any():
            return parts
    raise AssertionError("some have not alarmed")


def test_false_alarms_are_no_oftener_than_told():
    told = ControlChart({"stock": BATCH["stock"]}).parts_per_false_alarm
    assert told == pytest.approx(139.2, abs=0.1)
    parts = first_alarms(4000, np.random.default_rng(3))
    assert told < parts.mean() < 1.35 * told
    assert chart().parts_per_false_alarm == pytest.approx(told / 2)  # two quantities
    assert chart(sigmas=3.5).parts_per_false_alarm > 5 * chart().parts_per_false_alarm


def test_the_average_sees_a_shift_that_single_values_do_not():
    """One sd: 9.6 parts on average (Lucas and Saccucci), single values 44, within four standard errors."""
    rng, waits = np.random.default_rng(4), {"value": [], "average": []}
    for rule, found in waits.items():
        for _ in range(100):
            made, part = chart(), 0
            limits = made.limits["stock"]
            while rule not in {signal.rule for signal in made.signals}:
                made.update(stock=limits.mean + limits.sd * (1.0 + rng.standard_normal()))
                part += 1
            found.append(part)
    for rule, mean in (("average", 9.6), ("value", 43.9)):
        assert np.mean(waits[rule]) == pytest.approx(mean, abs=4 * np.std(waits[rule]) / np.sqrt(100))
    assert np.mean(waits["average"]) < np.mean(waits["value"]) / 2


def test_run_length_of_the_average():
    # Lucas and Saccucci
    assert ewma_run_length(0.2, 3 * np.sqrt(0.2 / 1.8)) == pytest.approx(559.9, rel=1e-3)
    assert ewma_run_length(1.0, 3.0) == pytest.approx(370.4, rel=1e-3)


def test_summary_for_the_machine_upstream():
    made = chart(units={"roundness": "mm"})
    assert json.loads(json.dumps(made.summary))["quantities"]["stock"]["last"] is None
    made.update(roundness=0.0101, stock=0.149)
    made.update(stock=0.25)
    told = json.loads(json.dumps(made.summary))
    assert told["parts"] == 2 and told["quantities"]["roundness"]["in_control"]
    stock = told["quantities"]["stock"]
    assert stock["unit"] == "mm" and stock["last"] == 0.25 and not stock["in_control"]
    assert (
        stock["signals"][0].startswith("part 1: stock 0.25 is above 0.2")
        and "change of stock 0.101" in stock["signals"][1]
    )
    assert all(signal.endswith(" mm") for signal in stock["signals"])
    assert repr(made) == "ControlChart(roundness, stock over 2 parts: out of control: stock)"
    low = made.update(roundness=0.001)
    assert str(low[0]).startswith("part 2: roundness 0.001 is below 0.00")
    made.reset()
    assert made.count == 0 and made.signals == () and repr(made).endswith("in control)")


def test_missing_values_are_passed_over():
    made = chart()
    for value in (0.15, np.nan, np.float32("nan"), 0.16):
        assert made.update(stock=value) == ()
    assert (
        made.summary["quantities"]["stock"]["last"] == 0.16
        and made.summary["quantities"]["roundness"]["last"] is None
    )


@pytest.mark.parametrize("parts", [0, 1, 40])
def test_a_loaded_chart_goes_on(tmp_path, parts):
    """Bit-equal signals, averages and summary of a saved and loaded chart."""
    rng, whole, path = (
        np.random.default_rng(6),
        chart(sigmas=2.0, weight=0.37, units={"stock": "um"}),
        tmp_path / "chart.nc",
    )
    rows = [
        {"roundness": value, "stock": stock}
        for value, stock in rng.normal((0.011, 0.16), (0.001, 0.02), (80, 2))
    ]
    rows[3].pop("stock")
    rows[5]["roundness"] = np.nan
    for row in rows[:parts]:
        whole.update(**row)
    whole.save(path)
    loaded = sdpgrind.load(path)
    assert type(loaded) is ControlChart and loaded.limits == whole.limits and loaded.signals == whole.signals
    for row in rows[parts:]:
        assert loaded.update(**row) == whole.update(**row)
    assert len(whole.signals) > 20 and loaded.signals == whole.signals
    assert loaded.summary == whole.summary and repr(loaded) == repr(whole)
    for name in whole.limits:
        for old, new in zip(whole._history(name), loaded._history(name), strict=True):
            np.testing.assert_array_equal(new, old)


def test_picture():
    pyplot = pytest.importorskip("matplotlib.pyplot")
    pyplot.switch_backend("agg")
    made = chart()
    for stock in (0.15, 0.16, 0.26):
        made.update(roundness=0.0105, stock=stock)
    figure = made.plot()
    assert [axis.get_ylabel() for axis in figure.axes] == [
        "roundness [µm]",
        "stock [mm]",
        "change [µm]",
        "change [mm]",
    ]
    rings = [line for line in figure.axes[1].lines if line.get_markerfacecolor() == "none"]
    assert [line.get_xdata()[0] for line in rings] == [2]


@pytest.mark.parametrize(
    ("call", "error", "said"),
    [
        (lambda: ControlChart({}), TypeError, "batch must be a mapping of names to values"),
        (
            lambda: ControlChart({"stock": np.arange(19.0)}),
            ValueError,
            r"batch\['stock'\] must be 20 values or more; got 19",
        ),
        (
            lambda: ControlChart({"stock": np.ones(30)}),
            ValueError,
            r"batch\['stock'\] must be values that are not all alike \(mm\)",
        ),
        (
            lambda: ControlChart({"stock": [np.nan] * 30}),
            ValueError,
            r"stock\[0\] must be finite \(mm\); got nan",
        ),
        (
            lambda: chart(units={"stok": "mm"}),
            ValueError,
            "units must be one of roundness, stock; got 'stok'",
        ),
        (lambda: chart(weight=0.0), ValueError, r"weight must be in \(0, 1\] \(1\); got 0.0"),
        (lambda: chart(sigmas=0.0), ValueError, r"sigmas must be > 0 \(1\); got 0.0"),
        (lambda: chart().update(stok=0.1), ValueError, "values must be one of roundness, stock; got 'stok'"),
        (lambda: chart().update(stock="much"), TypeError, r"stock must be a number \(mm\); got 'much'"),
    ],
)
def test_refusals(call, error, said):
    with pytest.raises(error, match=said):
        call()
