"""The record of doubts and what it is made of: verdicts, alignment, gauges, stakes, the reader's word."""

import csv

import numpy as np
import pytest
from scipy import stats

from sdpgrind.base.columns import commands
from sdpgrind.base.columns.source import ColumnNote, Source
from sdpgrind.base.doubts import alignment, assumed, gauge, rows
from sdpgrind.base.doubts.rows import Doubt
from sdpgrind.base.doubts.stakes import Figure, Stake, stakes, together
from sdpgrind.identify import Doubts, Estimate, Status


def estimate(value, sd, freedom=np.inf, status=Status.OK):
    return Estimate(("tau",), [value], [[sd**2]], status, units=("s",), freedom=freedom)


@pytest.mark.parametrize("freedom", [7.0, np.inf])
def test_the_chance_is_that_of_the_interval(freedom):
    """Two ways: a believed value at an end of the 95 % interval differs by a chance of 5 %; scipy's law."""
    found = estimate(2.0, 0.1, freedom)
    high = float(found.interval()[0, 1])
    assert rows.compared(found, "tau", high).chance == pytest.approx(0.05, rel=1e-9)
    assert rows.compared(found, "tau", high + 1e-6).verdict == "differs"
    assert rows.compared(found, "tau", high - 1e-6).verdict == "agrees"
    law = stats.t(freedom) if np.isfinite(freedom) else stats.norm
    assert rows.compared(found, "tau", 1.7).chance == pytest.approx(2 * law.cdf(-3.0), rel=1e-9)


def test_an_interval_ends_at_a_physical_bound():
    found = estimate(1.0, 0.8)
    assert rows.compared(found, "tau", 1.0).low < 0.0 == rows.compared(found, "tau", 1.0, least=0.0).low
    assert rows.compared(found, "tau", 1.0, least=0.0).high == found.interval()[0, 1]


def test_a_reason_without_a_plan_has_few_digits():
    def solved(name, value):
        raise ValueError(f"{name} must be > 0, or 0.125; got {value!r}")

    (found,) = stakes(
        [Doubt("a", "s", 1.0, 1.0, -0.9827968067509945, 2.0, "agrees")], Figure("t", "s", 1.0), solved
    )
    assert found.reason == "a must be > 0, or 0.125; got -0.9828"


def test_what_is_not_told():
    assert rows.compared(estimate(1.0, 1.1), "tau", 1.0).verdict == "not told"
    assert rows.compared(estimate(0.0, 0.1), "tau", 0.0).verdict == "not told"
    assert rows.compared(estimate(0.0, 0.1), "tau", 0.0, scale=1.0).verdict == "agrees"
    failed = rows.compared(estimate(1.0, 0.1, status=Status.NOT_IDENTIFIED), "tau", 1.0)
    assert failed.verdict == "not told" and np.isnan(failed.told)
    assert rows.compared(estimate(2.0, 0.0), "tau", 2.0).verdict == "agrees"
    assert rows.compared(estimate(2.0, 0.0), "tau", 2.1).verdict == "differs"


@pytest.mark.parametrize("way", commands.ALIGNMENTS)
def test_commands_as_recorded(way):
    command = np.array([4.0, 4.0, 1.0, 1.0, 0.0, 0.0])
    before = np.concatenate([command[:1], command[:-1]])
    file = {"begin": command, "end": before, "centre": (command + before) / 2}[way]
    read = commands.held(file, way)
    np.testing.assert_allclose(commands.recorded(read, way), file, atol=1e-12)
    if way != "centre":  # a mean of means is an approximation
        np.testing.assert_array_equal(read, command)


def test_an_alignment_is_preferred_from_F_of_4_on():
    squares = {"begin": 1.0, "centre": 1.0 + 4.0 / 98, "end": 2.0}
    found = alignment.preferred(squares, 100)
    assert (found.preferred, found.second) == ("begin", "centre") and found.decisiveness == pytest.approx(4.0)
    assert found.excess == pytest.approx(4.0 / 98) == pytest.approx(found.needed)
    assert not alignment.preferred(squares | {"centre": 1.04}, 100).sure
    assert alignment.preferred(dict.fromkeys(squares, 0.0), 100).preferred == "not sure"


def test_the_step_of_a_gauge():
    rng = np.random.default_rng(0)
    smooth = np.linspace(0.0, 0.2, 300) + rng.normal(0.0, 3e-4, 300)
    assert gauge.step_of(smooth) == 0.0
    assert gauge.step_of(np.round(smooth, 4)) == pytest.approx(1e-4, rel=1e-6)
    assert gauge.step_of(-0.5e-3 * np.round(2e3 * smooth, 1)) == pytest.approx(5e-5, rel=1e-6)
    coarse = 1e-3 * np.rint(smooth / 1e-3)
    assert gauge.step_of(coarse) == pytest.approx(1e-3, rel=1e-6)
    assert gauge.step_of(np.float32(coarse).astype(float)) == pytest.approx(1e-3, rel=1e-3)
    assert gauge.step_of(np.array([1.0, 2.0])) == 0.0
    every_third = 3.0 * rng.integers(0, 50, 200) + 2.0 * (rng.integers(0, 2, 200) == 1)
    assert gauge.step_of(every_third) == pytest.approx(1.0)
    few = [820.0, 1160.0, 920.0, 1300.0, 1020.0, 1440.0, 1120.0, 1580.0]  # a power display of 0.02 kW
    assert gauge.step_of(np.array(few)) == 20.0 and gauge.step_of(np.array(few) + smooth[:8]) == 0.0


def test_clipped_readings_pile_up():
    power = 1000 + 200 * np.sin(np.linspace(0.0, 20.0, 400))
    assert gauge.clipped(power) == 0
    assert gauge.clipped(np.minimum(power, 1150.0)) == int(np.sum(power >= 1150.0))
    assert gauge.clipped(np.round(power, -1)) == 0  # a coarse gauge at the top of a wave


def test_bends_are_found_and_noise_is_not():
    time = np.arange(240) * 0.05
    rng = np.random.default_rng(1)
    noise = [rng.normal(size=240) for _ in range(200)]
    assert sum(gauge.bend(each, time, 0.0) is not None for each in noise) <= 2  # 0.1 % each by chance
    bent = noise[0] + np.where((time > 4.0) & (time < 6.0), 3.0, 0.0)
    found = gauge.bend(bent, time, 0.0)
    assert 4.0 < time[found.first] < 6.0 and found.mean == pytest.approx(3.0, abs=0.8)


def test_stakes_are_ordered_and_say_where_no_plan_is():
    def solved(name, value):
        if name == "c" and value > 3:
            raise ValueError("c must be <= 3")
        return None if name == "d" else {"a": 1.0, "b": 10.0, "c": 0.1}[name] * value

    given = [Doubt(name, "1", 1.0, 2.0, 0.5, 3.5, "differs", 0.01) for name in "abcd"]
    found = stakes([*given, rows.untold("e", "1", 1.0)], Figure("time", "s", 1.0), solved)
    assert [stake.name for stake in found] == ["b", "a", "c"]
    assert (found[0].at_low, found[0].at_high) == (5.0, 35.0)
    assert np.isnan(found[-1].at_high) and found[-1].reason == "c must be <= 3"
    assert Stake("a", "1", 0.5, 3.5, 9.0, 13.0).change(10.0) == 3.0  # as the page shows it
    assert Stake("a", "1", 0.5, 3.5, 9.0, 13.0).change(np.nan) == np.inf  # no plan: in their order


def test_values_together_are_a_stake_of_their_own(tmp_path):
    two = (Stake("a", "1", 1.0, 2.0, np.nan, np.nan, "b is less"), Stake("b", "1", 1.0, 2.0, 8.0, 9.0))
    assert together(two[:1], lambda: 7.0) == two[:1]
    found = together(two, lambda: 7.0, "where b is less")
    assert found[:2] == two and found[2].change(5.0) == 2.0
    page = str(Doubts("a cycle", [], figure=Figure("time", "s", 5.0), stakes=found))
    words = "all of them each as told: 7.0000 s +2 s where b is less"
    assert " ".join(page.splitlines()[-1].split()) == words

    def fails():
        raise ValueError("b must be < 1.23456789")

    assert together(two, fails)[2].reason == "b must be < 1.235"
    assert "each as told: no plan" in str(
        Doubts("", [], figure=Figure("", "s", 5.0), stakes=together(two, fails))
    )
    row = Doubt("b", "1", 1.0, 1.5, 1.0, 2.0, "agrees", 0.1)
    drawn = Doubts("a cycle", [row], figure=Figure("time", "s", 5.0), stakes=found)
    assert len(drawn.plot().axes) == 2
    drawn.save(tmp_path / "doubts.nc")
    assert str(Doubts.from_file(tmp_path / "doubts.nc")) == str(drawn)
    drawn.report(tmp_path / "doubts.html")
    assert "nan" not in (tmp_path / "doubts.html").read_text("utf-8").partition("Problem")[0]


def test_what_the_call_told_is_assumed():
    columns = (
        ColumnNote("time", "s", "t", "ms", "bracket", 1e-3),
        ColumnNote("size", "mm", "X", "um", "call", -0.5e-3),
        ColumnNote("command_rate_command", "mm/s", "v", "mm/min", "unit row", 1 / 60),
    )
    source = Source((), columns, 1, 100, gaps=((0, 1.0, 0.5),), commands_at="end", notes=("plausible=False",))

    class Read:
        pass

    log = Read()
    log.source = source
    found = assumed.reader_of(log)
    assert found.commands_at == "end"
    told = {row.name: row.believed for row in found.rows}
    assert told["unit of size"] == "um" and told["factor of size"] == "-0.5"
    assert told["commands_at"] == "'end'" and told["gaps"].startswith("1,") and len(told) == 5
    table = Read()
    table.attrs = {"source": source.to_json()}
    assert assumed.reader_of(table, table) == found
    assert assumed.reader_of({"size": [0.0]}, {"size": [0.0]}) == ("begin", ())


def record():
    told = Doubt("tau", "s", 1.9, 1.4, 1.39, 1.41, "differs", 1e-9, "linear lag")
    every = [told, rows.untold("width", "mm", 9.0, "a fact"), rows.assumed("commands_at", "'begin'", "said")]
    stake = Stake("tau", "s", 1.39, 1.41, 10.9, 11.1)
    return Doubts(
        "a cycle",
        every,
        ("One sentence.",),
        alignment.preferred({"begin": 1.0, "end": 1.45, "centre": 1.5}, 245),
        Figure("time", "s", 12.0),
        [stake],
    )


def test_saved_loaded_written_drawn(tmp_path):
    doubts = record()
    doubts.save(tmp_path / "doubts.nc")
    again = Doubts.from_file(tmp_path / "doubts.nc")
    assert str(again) == str(doubts) and repr(again) == repr(doubts)
    assert again.alignment == "begin" and again.stakes == doubts.stakes and again["tau"] == doubts["tau"]
    doubts.to_csv(tmp_path / "doubts.csv")
    with (tmp_path / "doubts.csv").open(encoding="utf-8") as file:
        table = list(csv.DictReader(file))
    assert [row["name"] for row in table] == ["tau", "width", "commands_at"]
    assert float(table[0]["low"]) == 1.39 and table[0]["verdict"] == "differs"
    assert len(doubts.plot().axes) == 2
    with pytest.raises(KeyError, match="name must be one of tau, width, commands_at; got 'mu'"):
        doubts["mu"]


def test_the_page():
    page = str(record())
    assert "tau [s]  1.9       1.400  (1.390 to 1.410)  differs (by chance < 0.01 %)" in page
    told = "The data tell 1 of 2 values of the model; tau differs from what the problem holds"
    assert told in page.replace("\n", " ")
    assert "- width: a fact" in page and "- commands_at: 'begin'; said" in page and "- One sentence." in page
    assert "1.390: 10.90 s  1.410: 11.10 s   -1.1 s" in page
    assert "width" in (shown := record()._repr_html_()) and "not told: a fact" in shown
    assert "as large as it is" not in shown  # of a value that has none
    assert repr(record()) == "Doubts(a cycle: 0 agrees, 1 differs of 3 rows)"


def test_nothing_told_is_said_once():
    page = str(Doubts("a cycle", [rows.untold("width", "mm", 9.0, "a drawing")]))
    assert "The data tell none of 1 value of the model." in page and page.count("data tell") == 1


def test_the_sentence_on_alignment_says_what_the_data_reject_and_by_how_much():
    found = alignment.preferred({"begin": 1.0, "end": 1.45, "centre": 1.9}, 202)  # 4/200 is 2 %
    taus = {"begin": 1.4, "end": 1.45}
    as_read = alignment.alignment_sentence(found, "begin", "time_constant", taus, "s")
    assert (
        "commands_at='begin', and the data confirm it: 'end'" in as_read
        and "time_constant would be" in as_read
    )
    assert "a sum of squared residuals 45 % larger than 'begin' (2.0 % would be enough)" in as_read
    other = alignment.alignment_sentence(found, "end", "time_constant", taus, "s")
    assert "reject that for 'begin'" in other and other.endswith("read again with commands_at='begin'.")
    near = alignment.preferred({"begin": 1.0, "end": 1.01, "centre": 1.9}, 202)
    unsure = alignment.alignment_sentence(near, "begin", "time_constant", taus, "s")
    assert "neither confirm nor reject: 'end' leaves a sum of squared residuals 1.0 % larger" in unsure
    assert all("F =" not in sentence for sentence in (as_read, other, unsure))


@pytest.mark.parametrize(
    ("excess", "words"), [(0.016, "1.6 %"), (4.0, "4.0 times"), (np.inf, "over 100000 times")]
)
def test_excess_in_words(excess, words):
    from sdpgrind.base.doubts.words import share

    assert share(excess) == words


def test_the_page_says_its_subject_and_keeps_numbers_with_their_units():
    assert record().report().splitlines()[3] == "a cycle"
    long = Doubts("a cycle", [], [f"{'word ' * 20}1.23 %", f"{'word ' * 21}4 um."])
    assert "1.23 %" in str(long) and "4 um" in str(long)
    lines = str(long).splitlines()
    assert max(map(len, lines)) <= 110 and not any(line.strip().startswith(("%", "um")) for line in lines)
