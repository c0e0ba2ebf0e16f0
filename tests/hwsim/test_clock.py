"""Ticks: exact for every rate, refused where there is none."""

from fractions import Fraction

import pytest
from hwsim_inside import Clock, common_tick, exact, simplest
from hypothesis import given
from hypothesis import strategies as st


def test_common_tick_of_the_rates_of_the_house():
    assert common_tick({"force": 1 / 60, "speed": 1 / 100, "scan": 0.5}) == Fraction(1, 300)
    assert common_tick({"a": 0.04, "b": 1 / 60}) == Fraction(1, 300)
    assert common_tick({"a": 2.0, "b": 6.0}) == 2


@given(st.lists(st.fractions(Fraction(1, 1000), 100, max_denominator=1000), min_size=1, max_size=3))
def test_every_rate_is_a_whole_number_of_ticks_and_no_longer_tick_does_it(rates):
    named = {str(k): float(rate) for k, rate in enumerate(rates)}
    try:
        tick = common_tick(named)
    except ValueError:
        assert max(rate.denominator for rate in rates) > 90  # three denominators whose multiple exceeds 10^6
        return
    ticks = [Clock(tick).ticks(name, seconds) for name, seconds in named.items()]
    assert [n * tick for n in ticks] == rates
    for factor in (2, 3, 5, 7):
        assert any((rate / (factor * tick)).denominator != 1 for rate in rates)


def test_seconds_are_correctly_rounded():
    clock = Clock(Fraction(1, 1000))
    assert [clock.seconds(t) for t in (1, 54000, 300)] == [0.001, 54.0, 0.3]
    assert clock.all_seconds([1, 300]).tolist() == [0.001, 0.3]
    assert clock.nearest(8.0004) == 8000


def test_binary_value_where_there_is_no_simple_fraction():
    assert simplest(0.1) == Fraction(1, 10)
    assert simplest(-2.5) == Fraction(-5, 2)
    assert float(simplest(0.12345678901234567)) == 0.12345678901234567


@pytest.mark.parametrize("rate", [3.14159265358979, 1e-8])
def test_refuses_a_rate_that_is_no_simple_fraction(rate):
    with pytest.raises(ValueError, match=r"period must be a whole number of microseconds .* \(s\); got"):
        exact("period", rate)


def test_refuses_rates_without_a_reasonable_tick():
    with pytest.raises(ValueError, match=r"common tick of at least 1e-06 s; got a = .* s, b = "):
        common_tick({"a": 1 / 44100, "b": 1 / 48000})


def test_refuses_a_remainder():
    with pytest.raises(ValueError, match=r"period must be a whole number of ticks of 1/10 s \(s\); got 0.25"):
        Clock(Fraction(1, 10)).ticks("period", 0.25)


@pytest.mark.parametrize("rate", [0.0, -1.0])
def test_refuses_a_rate_that_is_not_positive(rate):
    with pytest.raises(ValueError, match="tick must be > 0"):
        common_tick({"tick": rate})
