"""Faults of readings: the rows of the specification, nesting, order, draws that do not touch each other."""

import copy
import pickle
from math import isnan, nan, sqrt

import faults_fakes as fakes
import numpy as np
import pytest
from faults_fakes import Counter, Steady, readings
from hwsim_fakes import FixedTank, Tank
from hwsim_inside import fingerprint
from hypothesis import given
from hypothesis import strategies as st

import hwsim
from hwsim import faults
from hwsim.faults._plant import warn_of_idle
from sdpgrind import plunge, weldbead

COUNTER = Counter()
READING = (faults.Dropped, faults.Late, faults.Duplicated)


def rows_equal(one, other):
    return np.array_equal(one, other, equal_nan=True)


@pytest.mark.parametrize(
    ("fault", "row"),
    [
        (faults.DeadTime(COUNTER, samples=1), [nan, 1, 2, 3, 4, 5]),
        (faults.DeadTime(COUNTER, samples=3), [nan, nan, nan, 1, 2, 3]),
        (faults.Stuck(COUNTER, at=2), [1, 2, 3, 3, 3, 3]),
        (faults.Stuck(COUNTER, at=0), [1, 1, 1, 1, 1, 1]),
        (faults.Late(COUNTER, at=[1, 3]), [1, 1, 3, 3, 5, 6]),
        (faults.Late(COUNTER, at=(3, 1)), [1, 1, 3, 3, 5, 6]),
        (faults.Duplicated(COUNTER, at=[1, 3]), [1, 1, 3, 3, 5, 6]),
        (faults.Late(COUNTER, share=1.0), [1, 1, 2, 3, 4, 5]),
        (faults.Dropped(COUNTER, at=4), [1, 2, 3, 4, nan, 6]),
        (faults.Bias(COUNTER, of="x", by=0.5), [1.5, 2.5, 3.5, 4.5, 5.5, 6.5]),
        (faults.Bias(COUNTER, of="x", by=0.5, at=2), [1, 2, 3.5, 4, 5, 6]),
        (faults.Spike(COUNTER, of="x", size=-10.0, at=1), [1, -8, 3, 4, 5, 6]),
        (faults.Dropped(COUNTER, share=1.0), [nan] * 6),
    ],
    ids=lambda each: type(each).__name__,
)
def test_rows_of_the_readings_1_to_6(fault, row):
    assert rows_equal(readings(fault), row)
    other = readings(fault, of="y")
    whole = row if getattr(fault, "of", None) is None else [1, 2, 3, 4, 5, 6]
    assert rows_equal(other, whole)


NUMBERS = st.sets(st.integers(0, 11), min_size=1, max_size=6)
LATER = st.sets(st.integers(1, 11), min_size=1, max_size=6)  # nothing comes before the first sample
LAYERS = st.one_of(
    st.tuples(st.just("Late"), LATER),
    st.tuples(st.just("Duplicated"), LATER),
    st.tuples(st.just("Dropped"), NUMBERS),
    st.tuples(st.just("Bias"), NUMBERS),
    st.tuples(st.just("Spike"), NUMBERS),
    st.tuples(st.just("DeadTime"), st.integers(1, 5)),
    st.tuples(st.just("Stuck"), st.integers(0, 11)),
)


def wrapped(plant, kind, where, of):
    """A fault around a plant, and what it does to a row."""
    if kind == "DeadTime":
        return faults.DeadTime(plant, samples=where, of=of), lambda row: fakes.dead_time(row, where)
    if kind == "Stuck":
        return faults.Stuck(plant, at=where, of=of), lambda row: fakes.stuck(row, where)
    if kind == "Bias":
        return faults.Bias(plant, of=of, by=0.25, at=where), lambda row: fakes.added(row, where, 0.25)
    if kind == "Spike":
        return faults.Spike(plant, of=of, size=8.0, at=where), lambda row: fakes.added(row, where, 8.0)
    row_of = fakes.dropped if kind == "Dropped" else fakes.repeated
    return getattr(faults, kind)(plant, of=of, at=where), lambda row: row_of(row, where)


@given(st.lists(st.tuples(LAYERS, st.sampled_from(["x", "y"])), max_size=5))
def test_faults_nest_from_the_inside_to_the_outside(layers):
    plant, rows = COUNTER, {name: [float(k) for k in range(1, 13)] for name in ("x", "y")}
    for (kind, where), of in layers:
        plant, change = wrapped(plant, kind, where, of)
        rows[of] = change(rows[of])
    for name, row in rows.items():
        assert rows_equal(readings(plant, 12, name), row)
    names = [name for name in plant.outcomes if name.startswith("seen_")] if layers else []
    assert len(names) == len(layers)


CHANCES = st.lists(
    st.tuples(st.sampled_from(READING), st.sampled_from(["x", "y", None]), st.floats(0, 1)), max_size=4
)


@given(CHANCES, CHANCES, st.integers(0, 2**32), st.floats(0, 1))
def test_no_fault_changes_the_draws_of_another(inside, outside, seed, share):
    """Which samples a fault strikes depends on nothing but the seed, its kind and its measurement."""

    def struck(plant):
        return [isnan(each) for each in readings(plant, 20, "noise", seed)]

    def around(plant, layers):
        for kind, of, chance in layers:
            if of is not None:
                plant = kind(plant, of=of, share=chance)
        return plant

    alone = struck(faults.Dropped(COUNTER, of="noise", share=share))
    nested = around(faults.Dropped(around(COUNTER, inside), of="noise", share=share), outside)
    assert struck(nested) == alone
    assert readings(around(COUNTER, inside), 20, "noise", seed) == readings(COUNTER, 20, "noise", seed)


@given(st.integers(0, 2**32), st.floats(0, 1), st.floats(0, 1))
def test_a_greater_share_strikes_the_same_samples_and_more(seed, one, other):
    def struck(share):
        row = readings(faults.Dropped(COUNTER, share=share), 40, seed=seed)
        return {k for k, value in enumerate(row) if isnan(value)}

    less, more = sorted((one, other))
    assert struck(less) <= struck(more)


def test_the_share_is_a_probability_and_parts_differ():
    plant = faults.Dropped(Counter(steps=10**6), share=0.2)
    rows = [np.isnan(readings(plant, 2000, seed=seed)) for seed in (1, 2)]
    for row in rows:
        assert abs(row.mean() - 0.2) < 5 * sqrt(0.2 * 0.8 / row.size)
    assert np.any(rows[0] != rows[1]) and np.array_equal(rows[0], np.isnan(readings(plant, 2000, seed=1)))


def test_two_of_a_kind_on_one_measurement_draw_apart_and_count_apart():
    one = faults.Dropped(COUNTER, of="x", share=0.5)
    two = faults.Dropped(one, of="x", share=0.5)
    three = faults.Dropped(two, of="x", share=0.5)
    assert list(three.outcomes)[-3:] == ["seen_dropped_x", "seen_dropped_x_2", "seen_dropped_x_3"]
    machine = three.start(np.random.default_rng(3))
    for k in range(30):
        machine.step({}, k > 0)
    counts = [machine.outcome()[name] for name in list(three.outcomes)[-3:]]
    missing = sum(np.isnan(readings(three, 30, seed=3)))
    assert max(counts) < missing < 30 and all(4 < each < 26 for each in counts)  # +-4 sd of 15


def test_sizes_of_spikes_are_normal_and_do_not_depend_on_where_they_strike():
    plant = faults.Spike(Counter(steps=10**6), of="x", size=100.0, sd=2.0, share=1.0)
    sizes = np.array(readings(plant, 2000)) - np.arange(1, 2001)
    assert abs(sizes.mean() - 100.0) < 5 * 2.0 / sqrt(2000)
    assert abs(sizes.std() - 2.0) < 5 * 2.0 / sqrt(2 * 2000)
    some = faults.Spike(Counter(steps=10**6), of="x", size=100.0, sd=2.0, at=[7, 1500])
    row = np.array(readings(some, 2000)) - np.arange(1, 2001)
    assert row[[7, 1500]].tolist() == sizes[[7, 1500]].tolist() and np.count_nonzero(row) == 2


def plunging():
    problem = plunge.preset("simulation").replace(stock=0.005)
    return hwsim.PlungeGrinder(problem), plunge.CycleController(problem), "size"


def grinding():
    class Passes:
        period = None

        def reset(self):
            self.passes = 0

        def step(self, **measured):
            self.passes += 1
            return {"stop": 1.0} if self.passes > 3 else {"duration": 5.0, "normal_force": 30.0}

    return hwsim.WeldBeadStand(weldbead.preset("P1")), Passes(), "height"


@pytest.mark.parametrize("make", [plunging, grinding])
def test_faults_that_never_strike_change_no_bit(make):
    plant, controller, of = make()
    never = plant
    for kind in READING:
        never = kind(never, of=of, share=0.0)
    never = faults.Spike(never, of=of, size=1.0, sd=1.0, share=0.0)
    never = faults.PowerLoss(
        faults.ClockJump(faults.LinkCut(never, at=1e6, duration=1.0), at=1e6, by=1.0), at=1e6
    )
    plain = hwsim.run(plant, controller, parts=2, rng=4)
    with pytest.warns(UserWarning) as told:
        log = hwsim.run(never, controller, parts=2, rng=4)
    assert [str(each.message).partition("(")[0] for each in told] == ["LinkCut", "ClockJump", "PowerLoss"]
    assert log.outcome.attrs["plant"] == type(plant).__name__ and log.tiers == plain.tiers
    for name in plain.outcome:
        assert np.array_equal(log.outcome[name].values, plain.outcome[name].values, equal_nan=True), name
    assert all(
        log.outcome[name].values.tolist() == [0.0] * 2 for name in log.outcome if name not in plain.outcome
    )
    for name in plain["controller"]:
        one, two = log["controller"][name], plain["controller"][name]
        assert np.array_equal(one.values, two.values, equal_nan=True), name
        assert one.attrs == two.attrs


NEVER = (
    r"^Stuck\(of='x', at=1000000\) never struck: no part of the run came so far; outcome seen_stuck_x is 0$"
)


@pytest.mark.parametrize(
    "run",
    [
        lambda plant: hwsim.run(plant, Steady(), parts=2),
        lambda plant: hwsim.compare(plant, {"one": Steady(), "two": Steady()}, parts=2),
        lambda plant: hwsim.repeat(plant, Steady(), series=2, parts=2),
    ],
)
def test_a_fault_that_never_struck_is_told_once_at_the_end(run):
    with pytest.warns(UserWarning, match=NEVER) as told:
        run(faults.Dropped(faults.Stuck(COUNTER, of="x", at=10**6), at=1))
    assert len(told) == 1 and told[0].filename == __file__
    run(faults.Dropped(faults.Stuck(COUNTER, of="x", at=2), share=0.0))  # by chance: nothing is to be told


def test_a_fault_that_struck_in_one_part_is_not_told():
    warn_of_idle(faults.Stuck(COUNTER, at=2), [{"seen_stuck": 0.0}, {"seen_stuck": 3.0}])


def test_a_users_own_controller_under_two_faults():
    stand, controller, _ = grinding()
    hard = faults.Late(faults.Bias(stand, of="height", by=0.02), of="height", share=0.05)
    log = hwsim.compare(hard, {"ours": controller}, parts=20, rng=0)
    plain = hwsim.compare(stand, {"ours": controller}, parts=20, rng=0)
    late = log.outcome.seen_late_height.values
    read = [each["controller"].height.values.reshape(20, -1) for each in (log, plain)]
    off = ~(np.abs(read[0] - read[1] - 0.02) <= 1e-12)
    # each part has 4 readings that are acted on, the first of them never late: none of 60 has probability 5 %
    assert off.sum() == late.sum() > 0 and log.outcome.seen_bias_height.values.tolist() == [[4.0] * 20]
    assert np.array_equal(log.outcome.height, plain.outcome.height)  # this one does not look at it


def test_a_copy_of_a_machine_goes_on_as_the_machine():
    plant = faults.Stuck(
        faults.Late(faults.Spike(COUNTER, of="x", size=5.0, sd=1.0, share=0.5), share=0.5), at=9
    )
    machine = plant.start(np.random.default_rng(5))
    for k in range(6):
        machine.step({}, k > 0)
    twin = copy.deepcopy(machine)
    on = [machine.step({}, 1) for _ in range(8)]
    assert on == [twin.step({}, 1) for _ in range(8)] and machine.outcome() == twin.outcome()


def test_reading_again_is_no_new_sample():
    plant = faults.Late(faults.Dropped(COUNTER, of="y", at=[1]), at=[2])
    machine = plant.start(np.random.default_rng(0))
    rows = [(machine.step({}, k > 0), machine.step({}, 0), machine.step({"speed": 1.0}, 0)) for k in range(4)]
    assert [row[0]["x"] for row in rows] == [1.0, 2.0, 2.0, 4.0]
    for first, *others in rows:
        assert all(rows_equal(list(first.values()), list(other.values())) for other in others)
    assert machine.outcome()["seen_late"] == machine.outcome()["seen_dropped_y"] == 1.0


def test_arrays_are_struck_as_a_whole():
    class Scans(Counter):
        def start(self, rng):
            return Scanning(self, *rng.spawn(2))

    class Scanning(fakes.Counting):
        def step(self, command, ticks):
            return super().step(command, ticks) | {"x": self.samples * np.arange(3.0)}

    assert readings(faults.Bias(Scans(), of="x", by=1.0))[2].tolist() == [1.0, 4.0, 7.0]
    assert readings(faults.Late(Scans(), of="x", at=2))[2].tolist() == [0.0, 2.0, 4.0]
    assert isnan(readings(faults.Dropped(Scans(), at=2))[2])


def test_a_plant_that_leaves_a_measurement_out():
    late = faults.Late(Tank(), at=[1]).start(np.random.default_rng(0))
    late.step({}, 0)
    assert isnan(late.step({}, 1)["temperature"])
    assert all(
        isnan(each) for each in readings(faults.Bias(Tank(), of="temperature", by=1.0), 2, "temperature")
    )


def test_optional_members_are_those_of_the_plant():
    hard = faults.Dropped(COUNTER, share=0.1)
    assert hard.measures == COUNTER.measures and hard.accepts == COUNTER.accepts and hard.tick == 0.1
    assert hard.job is COUNTER.job and hard.safe is COUNTER.safe
    for name in ("ranges", "sample_ticks", "tables", "after", "look", "start_live"):
        assert not hasattr(hard, name)
    finer = hard.with_tick(0.05)
    assert finer.tick == 0.05 and finer.share == 0.1 and isinstance(finer, faults.Dropped)
    assert hwsim.check(hard, Steady(0.25)) and hwsim.check(faults.Late(hard, share=0.5), Steady(0.25))
    assert hwsim.run(hard, Steady(0.25)).column("controller", "time")[1] == 0.25
    assert not hwsim.check(faults.Dropped(FixedTank(), share=0.1), Steady(0.25))
    assert isinstance(hard, hwsim.protocols.Plant)
    assert isinstance(hard.start(np.random.default_rng(0)), hwsim.protocols.Machine)
    worn = faults.Late(hwsim.PlungeGrinder(plunge.preset("simulation")), of="size", share=0.1)
    if hasattr(worn.plant, "after"):
        assert hasattr(worn, "after")


def test_a_series_on_a_plant_that_parts_change():
    class Wearing(Counter):
        def after(self, outcome):
            return Wearing(self.steps - 1)

    log = hwsim.run(faults.Dropped(Wearing(steps=20), share=0.2), Steady(), parts=3)
    times = log["controller"].time.groupby(log["controller"].part).max().values
    assert times.tolist() == [2.0, 1.9, 1.8] and min(log.outcome.seen_dropped.values) > 0


def test_settings_are_part_of_the_identity(tmp_path):
    def hard(**changes):
        return faults.Late(faults.Bias(COUNTER, of="x", by=0.5), **{"of": "x", "share": 0.1, **changes})

    several = [hard(), hard(share=0.2), hard(of="y"), hard(share=None, at=3), hard().plant, COUNTER]
    several += [hard().replace(plant=faults.Bias(COUNTER, of="x", by=0.6)), faults.Duplicated(**vars(hard()))]
    assert len({fingerprint(each) for each in several}) == len(several)
    assert (
        fingerprint(pickle.loads(pickle.dumps(hard())))
        == fingerprint(copy.deepcopy(hard()))
        == fingerprint(hard())
    )
    assert pickle.loads(pickle.dumps(hard())) == hard() and hash(hard()) == hash(hard())
    path = tmp_path / "run.db"
    hwsim.run(hard(), Steady(), parts=2, journal=path)
    longer = hwsim.run(hard(), Steady(), parts=4, journal=path)
    assert np.array_equal(
        longer.outcome.seen_late_x, hwsim.run(hard(), Steady(), parts=4).outcome.seen_late_x
    )
    with pytest.raises(ValueError, match="plant"):
        hwsim.run(hard(share=0.2), Steady(), parts=4, journal=path)


def test_the_log_tells_the_plant_and_its_faults(tmp_path):
    hard = faults.Late(faults.Bias(COUNTER, of="x", by=0.5), of="x", share=0.1)
    log = hwsim.run(hard, Steady())
    told = "Bias(of='x', by=0.5); Late(of='x', share=0.1)"
    assert log.outcome.attrs["faults"] == told and log.outcome.attrs["plant"] == "Counter"
    assert repr(hard) == f"Late(of='x', share=0.1) on Bias(of='x', by=0.5) on {COUNTER!r}"
    assert log.outcome.seen_late_x.attrs == {"units": "1", "long_name": "seen late x"}


KNOWN = "x, y, clock, noise"


@pytest.mark.parametrize(
    ("make", "error", "message"),
    [
        (lambda: faults.Late(COUNTER, of="z", share=0.1), ValueError,
         rf"of must be one of the measurements of the plant: {KNOWN}; got 'z'"),
        (lambda: faults.Late(COUNTER), ValueError,
         r"one of share \(probability a sample\) or at \(numbers of samples, from 0\) must be given; got neither"),
        (lambda: faults.Late(COUNTER, share=0.1, at=3), ValueError, r"must be given; got share=0.1 and at=\(3,\)"),
        (lambda: faults.Late(COUNTER, share=1.5), ValueError, r"share must be in \[0, 1\]; got 1.5"),
        (lambda: faults.Late(COUNTER, at=[1, -2]), ValueError, r"at must be >= 0; got -2"),
        (lambda: faults.Late(COUNTER, at=[0, 3]), ValueError, "at must be >= 1: sample 0 has none before it; got 0"),
        (lambda: faults.Late(COUNTER, at=[]), ValueError, r"at must be at least one sample; got \[\]"),
        (lambda: faults.Late(COUNTER, at=0.5), TypeError, r"at must be a whole number; got 0.5"),
        (lambda: faults.Late(COUNTER, at="1"), TypeError, r"at must be a whole number; got '1'"),
        (lambda: faults.Stuck(COUNTER, at=-1), ValueError, r"at must be >= 0; got -1"),
        (lambda: faults.DeadTime(COUNTER, samples=0), ValueError, r"samples must be >= 1; got 0"),
        (lambda: faults.Bias(COUNTER, of=None, by=1.0), ValueError,
         rf"of must be one of the measurements of the plant: {KNOWN}; got None"),
        (lambda: faults.Bias(COUNTER, of="x", by=nan), ValueError, r"by must be finite \(mm\); got nan"),
        (lambda: faults.Bias(COUNTER, of="x", by=1.0, share=0.1, at=3), ValueError, r"got share=0.1 and at"),
        (lambda: faults.Spike(COUNTER, of="y", size="big", share=0.1), TypeError,
         r"size must be a number \(N\); got 'big'"),
        (lambda: faults.Spike(COUNTER, of="y", size=1.0, sd=-2.0, share=0.1), ValueError,
         r"sd must be >= 0 \(N\); got -2.0"),
        (lambda: faults.LinkCut(COUNTER, at=-1.0, duration=1.0), ValueError, r"at must be >= 0 \(s\); got -1.0"),
        (lambda: faults.LinkCut(COUNTER, at=1.0, duration=0.0), ValueError, r"duration must be > 0 \(s\); got 0"),
        (lambda: faults.ClockJump(COUNTER, at=1.0, by=nan), ValueError, r"by must be finite \(s\); got nan"),
        (lambda: faults.ClockJump(COUNTER, at=1.0, by=1.0, of="x"), ValueError,
         r"of must be a time that the plant measures in s: clock; got 'x'"),
        (lambda: faults.ClockJump(Tank(), at=1.0, by=1.0, of="level"), ValueError, r"in s: none; got 'level'"),
        (lambda: faults.PowerLoss(COUNTER, at=0.0), ValueError, r"at must be > 0 \(s\); got 0"),
        (lambda: faults.Late(Counter, share=0.1), TypeError,
         r"plant must be a simulated plant, such as hwsim.WeldBeadStand\(problem\); got .*Counter"),
        (lambda: faults.Late(Steady(), share=0.1), TypeError, r"plant must be a simulated plant"),
        (lambda: faults.Late(type("Real", (Counter,), {"start_live": None})(), share=0.1), TypeError,
         r"a real machine has faults of its own"),
    ],
)  # fmt: skip
def test_refusals(make, error, message):
    with pytest.raises(error, match=message):
        make()


def test_a_generator_without_a_seed_sequence_is_refused():
    rng = np.random.Generator(np.random.RandomState(1)._bit_generator)
    with pytest.raises(TypeError, match=r"rng must be a generator of numpy\.random\.default_rng; got"):
        faults.Late(COUNTER, share=0.1).start(rng)
