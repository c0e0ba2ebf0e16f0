"""Chatter bands against simulated oscillators and summed waves; free speeds; refusals."""

from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from scipy.signal import TransferFunction, lsim

from centering.setup import chatter_check
from sdpgrind import units

FORM = SimpleNamespace(
    upr=[2.0, 3.0, 6.0, 43.0, 44.0], amplitude=[0.155e-3, 0.206e-3, 0.048e-3, 0.235e-3, 0.040e-3]
)
WORK, QUIET_WHEEL = units.rpm(300), units.rpm(4210)
ROTATIONS = st.floats(5.0, 60.0)


def checked(form=FORM, *, work=WORK, wheel=QUIET_WHEEL, hz=218.0, **options):
    options = {"resonances": {"tailstock": units.hz(hz)}} | options
    return chatter_check(form, wheel_rotation=wheel, work_rotation=work, **options)


def one(upr, amplitude=1e-3):
    return SimpleNamespace(upr=[float(upr)], amplitude=[amplitude])


def test_the_worst_undulation_is_named():
    check = checked()
    (band,) = check.found
    assert (band.cause, band.upr, band.order, band.amplitude) == (
        "tailstock",
        43.0,
        0,
        0.235e-3,
    ) and not check.ok
    assert str(band) == "43 upr of 0.235 µm at the tailstock, which magnifies up to 16.1 times"
    assert band.center * 43 == pytest.approx(units.hz(218), rel=1e-3)
    slower, faster = sorted(check.nearest)
    assert slower < units.rpm(300) < faster
    assert all(checked(work=speed).ok for speed in (slower * 0.9999, faster * 1.0001))
    assert not any(checked(work=speed).ok for speed in (slower * 1.0001, faster * 0.9999))


@pytest.mark.parametrize("ratio", [0.7, 0.97, 1.0, 1.05, 1.4])
def test_magnification_by_simulation(ratio):
    """Steady deflection of a driven oscillator over its static deflection."""
    damping, natural, work = 0.05, 1000.0, 20.0
    upr = ratio * natural / work
    how = {"resonances": {"mode": natural}, "damping": damping, "reach": 0.9, "speed_error": 0.0}
    (band,) = checked(one(upr), work=work, wheel=1e4, **how).bands
    time = np.linspace(0.0, 0.4, 16_001)  # by 0.3 s the start has faded to 3e-7
    _, deflection, _ = lsim(
        TransferFunction([natural**2], [1, 2 * damping * natural, natural**2]),
        np.sin(upr * work * time),
        time,
    )
    assert band.gain == pytest.approx(np.abs(deflection[time > 0.3]).max(), rel=1e-3)


@given(damping=st.floats(0.005, 0.3), upr=st.integers(2, 200), work=ROTATIONS)
def test_bands_end_at_half_power(damping, upr, work):
    """Gain at the ends, by the complex response, is the peak over sqrt(2)."""
    natural = upr * work
    check = checked(
        one(upr), work=work, wheel=1e5, resonances={"mode": natural}, damping=damping, speed_error=0.0
    )
    (band,) = check.bands

    def gain(speed):
        return 1 / abs(1 - (upr * speed / natural) ** 2 + 2j * damping * upr * speed / natural)

    peak = gain(band.center)
    assert peak == pytest.approx(1 / (2 * damping * np.sqrt(1 - damping**2)), rel=1e-9)
    assert gain(band.low) == pytest.approx(peak / np.sqrt(2), rel=1e-9)
    assert gain(band.high) == pytest.approx(peak / np.sqrt(2), rel=1e-9)
    assert band.gain == pytest.approx(gain(work), rel=1e-9)


def test_damping_by_name():
    modes = {"head": units.hz(215), "wheel spindle": units.hz(600)}
    check = checked(resonances=modes, damping={"head": 0.02, "wheel spindle": 0.1})
    assert [band.cause for band in check.found] == ["head"]
    narrow, wide = (checked(hz=230, damping=ratio) for ratio in (0.01, 0.1))
    assert narrow.ok and not wide.ok


def summed(shift, turns):
    return abs(np.exp(2j * np.pi * shift * np.arange(turns)).sum()) / turns


@given(
    upr=st.integers(5, 60),
    work=ROTATIONS,
    shift=st.floats(-0.5, 0.5),
    turns=st.integers(1, 50),
    order=st.integers(1, 3),
)
@settings(deadline=None)
def test_waves_of_the_wheel_add_up_where_they_stay(upr, work, shift, turns, order):
    """Against the sum of each turn's waves."""
    wheel = (upr - shift) * work / order
    check = checked(one(upr), work=work, wheel=wheel, resonances={}, turns=turns, speed_error=0.0)
    assume(abs(abs(shift) - 0.5 / turns) > 1e-6)
    found = [band for band in check.found if band.order == order]
    assert bool(found) == (abs(shift) < 0.5 / turns)
    for band in found:
        assert band.gain == pytest.approx(summed(shift, turns), abs=1e-9) and band.gain > 0.63


@given(
    work=ROTATIONS,
    wheel=st.floats(100.0, 800.0),
    natural=st.floats(100.0, 4000.0),
    turns=st.integers(1, 50),
    error=st.sampled_from([None, 0.0, 0.02]),
)
@settings(max_examples=60, deadline=None)
def test_what_is_met_gains_as_much_as_is_said(work, wheel, natural, turns, error):
    """By default: the wheel more than 64 %, a mode more than half power, the greatest within the error."""
    form = SimpleNamespace(upr=np.arange(2.0, 61.0), amplitude=np.full(59, 1e-3))
    options = {} if error is None else {"speed_error": error}
    check = checked(form, work=work, wheel=wheel, resonances={"mode": natural}, turns=turns, **options)
    share = 0.005 if error is None else error
    near = np.linspace(work / (1 + share), work / (1 - share), 2001)
    for band in check.found:
        if band.order:
            shift = np.abs(band.upr - band.order * wheel / near)
            most = max(summed(each, turns) for each in shift[shift < 0.5][np.argsort(shift[shift < 0.5])[:3]])
            assert band.gain >= most - 1e-9 and 2 / np.pi - 1e-9 < band.gain <= 1
        else:
            ratio = band.upr * near / natural
            gains = 1 / np.abs(1 - ratio**2 + 0.06j * ratio)
            assert gains.max() - 1e-9 <= band.gain <= gains.max() * 1.01
            assert band.gain > 0.999 / (0.06 * np.sqrt(1 - 0.03**2)) / np.sqrt(2)


def test_undulations_beside_those_of_the_wheel_are_not_met():
    """Ratio 14.03: orders 1 to 3 meet 14, 28 and 42 upr within the error, not 15 and 29."""
    form = SimpleNamespace(upr=[14.0, 15.0, 28.0, 29.0, 42.0], amplitude=[1e-3] * 5)
    check = checked(form, resonances={})
    assert [(band.upr, band.order) for band in check.found] == [(14.0, 1), (28.0, 2), (42.0, 3)]
    assert [band.gain for band in check.found] == [1.0, 1.0, 1.0] and "up to 100 % of them add up" in repr(
        check
    )
    beside = [
        band for band in checked(form, resonances={}, reach=0.9).bands if (band.upr, band.order) == (29.0, 2)
    ]
    assert [band.gain for band in beside] == [0.0]


def test_the_wheel_is_named_with_its_order():
    check = checked(one(45), wheel=units.rpm(4500.0), resonances={})
    (band,) = check.found
    assert (
        band.order == 3
        and str(band) == "45 upr of 1 µm in step with 3 waves a turn of the wheel: up to 100 % of them add up"
    )
    assert checked(one(45), wheel=units.rpm(4500.0), resonances={}, wheel_orders=2).ok
    assert checked(one(45), wheel=units.rpm(4550.0), resonances={}).ok


@given(
    work=ROTATIONS,
    natural=st.floats(100.0, 4000.0),
    wheel=st.floats(100.0, 800.0),
    error=st.sampled_from([0.0, 0.005]),
)
@settings(max_examples=60, deadline=None)
def test_free_is_what_is_met_nowhere(work, natural, wheel, error):
    options = {"wheel": wheel, "resonances": {"mode": natural}, "speed_error": error}
    check = checked(work=work, **options)
    for low, high in check.free:
        assert check.speeds[0] <= low < high <= check.speeds[1]
    for speed in np.linspace(*check.speeds, 41)[1:-1]:
        free = any(low <= speed <= high for low, high in check.free)
        ends = [end for band in check.bands for end in (band.low, band.high)]
        if all(abs(speed - end) > 1e-9 * speed for end in ends):
            assert free == checked(work=speed, **options).ok
    assert check.ok == (check.nearest == (work,))


def test_where_no_rotation_is_free():
    check = checked(one(43), damping=0.3, reach=0.05)
    assert check.free == () and check.nearest == () and "no rotation in reach is free" in repr(check)


def test_what_is_small_or_noise_does_not_count():
    assert checked(amplitude_min=0.3e-3).ok
    noisy = SimpleNamespace(upr=FORM.upr, amplitude=FORM.amplitude, sd=np.full(5, 0.07e-3))
    assert checked(noisy).ok and not checked(SimpleNamespace(**vars(noisy) | {"sd": np.full(5, 0.05e-3)})).ok
    unknown = SimpleNamespace(upr=FORM.upr, amplitude=FORM.amplitude, sd=np.full(5, np.inf))
    assert not checked(unknown).ok
    assert checked(one(1), work=units.hz(218)).ok  # a part that is off-centre is not out of round


def test_words_and_picture():
    quiet = checked(hz=150)
    assert repr(quiet) == "ChatterCheck(at 300 rev/min nothing is met)"
    pyplot = pytest.importorskip("matplotlib.pyplot")
    pyplot.switch_backend("agg")
    top, low = checked().plot().axes
    assert [text.get_text() for text in top.texts] == ["43 upr: tailstock"]
    assert low.get_xlabel() == "rotation of the work [rev/min]" and low.get_xlim() == pytest.approx(
        (240.0, 360.0)
    )
    assert quiet.plot().get_suptitle() == "nothing is met"


@pytest.mark.parametrize(
    ("options", "error", "said"),
    [
        ({"work": 0.0}, ValueError, r"work_rotation must be > 0 \(rad/s\); got 0.0"),
        ({"wheel": -1.0}, ValueError, r"wheel_rotation must be > 0 \(rad/s\); got -1.0"),
        ({"resonances": {"head": 0.0}}, ValueError, r"head must be > 0 \(rad/s\); got 0.0"),
        (
            {"resonances": [1.0]},
            TypeError,
            r"resonances must be a mapping of names to natural frequencies \(rad/s\); got \[1.0\]",
        ),
        ({"damping": 0.5}, ValueError, r"damping of tailstock must be in \[1e-06, 0.35\] \(1\); got 0.5"),
        ({"damping": {"head": 0.1}}, ValueError, "names of damping must be one of head; got 'tailstock'"),
        ({"amplitude_min": -1e-3}, ValueError, r"amplitude_min must be >= 0 \(mm\); got -0.001"),
        ({"turns": 0}, ValueError, "turns must be >= 1; got 0"),
        ({"reach": 1.0}, ValueError, r"reach must be in \[0.001, 0.99\] \(1\); got 1.0"),
        (
            {"form": [1.0]},
            TypeError,
            r"spectrum must have arrays upr and amplitude, as Profile.harmonics gives; got \[1.0\]",
        ),
        (
            {"form": SimpleNamespace(upr=[1, 2], amplitude=[1.0])},
            ValueError,
            "upr and amplitude must be one-dimensional and of one",
        ),
    ],
)
def test_refusals(options, error, said):
    with pytest.raises(error, match=said):
        checked(**options)
