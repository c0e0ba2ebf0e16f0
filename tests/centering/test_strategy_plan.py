"""Strategies: against value iteration by hand, against simulation, kept and looked up, and what is refused."""

import warnings
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace

import matplotlib
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from push_inside import (
    FRACTIONS,
    FRICTION_SCALES,
    GIVEN_UP,
    SETTLED,
    FrictionScaleBelief,
    KindOfPush,
    Size,
    places,
    prepared,
    solved,
    table_speeds,
)
from scipy import sparse
from strategy_twins import quick_strategy

import sdpgrind
from centering import Strategy, plan, preset
from centering.cycle import PushKind
from centering.push.turning import spindle_speed_limit
from sdpgrind.base.progress import silent

matplotlib.use("Agg")
HEAVY = preset("printed")
LIGHT = HEAVY.replace(mass=0.8)
FEW = (PushKind("trapezoid", 5.0, True), PushKind("gentle", 40.0, True), PushKind("trapezoid", 83.0, True))


def test_a_table_that_creeps_has_no_more_readings_than_tell():
    """On the first 1.5 turns at 1e-5 rad/s there would be 94 million."""
    (place,) = places(HEAVY, 1e-5, 30.0, 3.0, 0)
    (usual,) = places(HEAVY, 10.0, 30.0, 3.0, 0)
    assert place.arc.size < 600 and place.sd[-1] <= usual.sd[-1]


def test_a_table_that_runs_up_gets_no_faster_than_it_may():
    """Four readings lie between two looks."""
    speed, sample = 1.0, HEAVY.limits.sample_time
    (place,) = places(HEAVY, speed, 10.0, 3.0, 0)
    assert np.diff(place.arc[12:]) == pytest.approx(4 * speed * sample)


@pytest.fixture(scope="module")
def heavy():
    return quick_strategy(HEAVY)


@pytest.fixture(scope="module")
def light():
    return quick_strategy(LIGHT)


@pytest.fixture(scope="module")
def rough():
    return quick_strategy(preset("identified"), kinds=FEW, size=Size(64, 3))


def by_hand(ground):
    """Value [pushes seen, node] by plain value iteration over pushes left, all kinds and shares side by side."""
    where, scale = ground.axes
    offset, friction = (
        x.ravel()
        for x in np.meshgrid(
            np.geomspace(where.low, where.high, where.nodes),
            np.linspace(scale.low, scale.high, scale.nodes),
            indexing="ij",
        )
    )

    def steps(seen):
        out = []
        for kind in range(len(ground.outcomes.kinds)):
            for share in FRACTIONS:
                push = KindOfPush(ground, kind, SETTLED)
                time, (starts, columns, weights) = push._follow(
                    offset, friction, np.full(offset.size, share), seen
                )
                out.append(
                    (time, sparse.csr_array((weights, columns, starts), shape=(offset.size, offset.size)))
                )
        return out

    most = ground.problem.pushes_max
    known = min(SETTLED, most - 1)
    value, settled = np.full(offset.size, GIVEN_UP), steps(known)
    for _ in range(most - known):
        value = np.min([time + step @ value for time, step in settled], axis=0)
    table = [value]
    for seen in reversed(range(known)):
        table.insert(0, np.min([time + step @ table[0] for time, step in steps(seen)], axis=0))
    return np.array(table)


@pytest.fixture(scope="module")
def ground():
    return prepared(HEAVY, "scheduled", FEW, Size(16, 3), None, silent)


@pytest.fixture(scope="module")
def few(ground):
    return solved(ground, None, silent)


@pytest.mark.parametrize("most", [60, 3, 1])
def test_value_is_that_of_plain_value_iteration(ground, most):
    ground = replace(ground, problem=HEAVY.replace(pushes_max=most))
    strategy = solved(ground, None, silent)
    value = strategy.dataset["value"].values.reshape(min(SETTLED, most - 1) + 1, -1)
    np.testing.assert_allclose(value, by_hand(ground), rtol=1e-10)
    assert len(strategy.plot().axes) == 5


def test_any_executor_gives_the_same_bits(few):
    with ThreadPoolExecutor(3) as pool:
        other = quick_strategy(HEAVY, kinds=FEW, size=Size(16, 3), executor=pool)
    assert few.dataset.identical(other.dataset)


@pytest.mark.parametrize(("which", "bar"), [("light", 4.0), ("heavy", 4.5)])
def test_prediction_and_exact_pushes_agree(request, which, bar):
    """Bars: >= 99 % finished within 60 pushes, mean cycle, prediction within 15 %; here on a coarse grid."""
    strategy = request.getfixturevalue(which)
    runs = strategy.simulate(runs=250, rng=1)
    predicted = np.mean([strategy.cycle_time(float(offset)) for offset in runs.start])
    assert np.mean(runs.finished) >= 0.98  # 99 %, less what 250 parts may miss it by
    assert runs.mean < bar
    assert runs.mean == pytest.approx(predicted, rel=0.15)
    assert np.all(runs.pushes <= strategy.problem.pushes_max)


def test_friction_of_a_part_persists(heavy):
    """The belief comes nearer to the hidden friction than the scatter of parts, and knows by how much."""
    rng, belief = np.random.default_rng(3), heavy.belief
    errors, claimed = [], []
    for _ in range(150):
        part = 1 + 0.08 * rng.standard_normal()
        friction, evidence, weights = 1.0, 0.0, None
        for _ in range(4):
            choice = heavy.push(offset=8.0, friction=friction, evidence=evidence)
            scale = part * (1 + 0.04 * rng.standard_normal())
            seen = heavy.outcomes.expected(choice.kind, choice.stroke, scale) + 0.7e-3 * rng.standard_normal()
            friction, evidence, weights = heavy.update_belief(
                friction, evidence, choice, seen, weights=weights
            )
        errors.append(friction - part)
        claimed.append(belief.sd(evidence))
    rms, said = np.sqrt(np.mean(np.square(errors))), np.sqrt(np.mean(np.square(claimed)))
    assert rms < 0.05
    assert rms == pytest.approx(said, rel=0.35)  # 150 parts: 6 %; the belief is kept as a normal law


def test_simulation_is_repeatable_and_starts_where_told(light):
    one, two = (light.simulate(runs=20, rng=7, start=2.0) for _ in range(2))
    np.testing.assert_array_equal(one.time, two.time)
    assert np.all(one.start == 2.0)
    assert one.dataset["time"].attrs["units"] == "s"
    assert "20 parts" in repr(one)


def test_pushes_are_simulated_and_not_looked_up(light):
    changed = Strategy(
        light.problem,
        light.outcomes.replace(travel=light.outcomes.travel + 0.05),
        light._speeds,
        (light._value, light._kind, light._share),
    )
    assert changed.simulate(runs=30, rng=0).mean > light.simulate(runs=30, rng=0).mean + 0.1


@given(offset=st.floats(0.0021, 12.0), friction=st.floats(0.7, 1.3), evidence=st.floats(0.0, 60.0))
def test_choices_are_sound(heavy, offset, friction, evidence):
    choice = heavy.push(offset=offset, friction=friction, evidence=evidence)
    assert np.isfinite(choice.stroke)
    assert choice.stroke > 0
    assert 0 < choice.spindle_speed <= HEAVY.limits.spindle_speed_max
    assert choice.spindle_speed**2 * offset < HEAVY.model.mu_static * 9807.0
    profile = heavy.profile(choice)
    position = np.cumsum(
        (profile.velocity + 0.5 * profile.acceleration * profile.duration) * profile.duration
    )
    assert position.max() == pytest.approx(choice.stroke, rel=1e-9)
    assert heavy.value(offset=offset, friction=friction, evidence=evidence) > 0.2


@given(offset=st.floats(0.01, 8.0), shift=st.floats(-0.9, 2.0))
def test_beliefs_stay_in_bounds(heavy, offset, shift):
    choice = heavy.push(offset=offset)
    belief = heavy.update_belief(1.0, 2.0, choice, max(0.0, choice.aim * (1 + shift)))
    assert FRICTION_SCALES[0] <= belief.friction <= FRICTION_SCALES[-1]
    assert belief.evidence >= 0.0
    assert np.all(belief.weights >= 0.0) and belief.weights.sum() == pytest.approx(1.0, rel=1e-12)


@pytest.mark.parametrize("offset", [0.01, 0.05, 0.2, 0.5, 1.0])
def test_a_travel_as_expected_takes_no_evidence_away(heavy, offset):
    """Of a longer blow several frictions may explain one travel: it may leave two of them."""
    choice = heavy.push(offset=offset)
    belief = heavy.update_belief(1.0, 2.0, choice, heavy.outcomes.expected(choice.kind, choice.stroke, 1.0))
    assert belief.evidence >= 1.9  # the nodes widen it by 1 %


@given(offset=st.floats(0.0021, 12.0), friction=st.floats(0.3, 3.0))
def test_there_is_a_push_for_any_friction(heavy, offset, friction):
    choice = heavy.push(offset=offset, friction=friction, evidence=2)
    assert 0 < choice.stroke <= heavy.outcomes.strokes[int(heavy.outcomes.last[choice.kind])] * (1 + 1e-9)


def test_a_table_of_other_friction_scales_is_refused(light):
    with pytest.raises(ValueError, match=r"travel must be of shape \(K, S, 62\)"):
        light.outcomes.replace(travel=light.outcomes.travel[:, :, 1:])


@pytest.mark.parametrize("offset", [0.0026, 0.004])
def test_a_part_nearly_centred_is_thrown_as_far_as_it_jumps(rough, offset):
    """Where stick and slip jump by more than the tolerance: it does not stick, with friction a deviation
    above the mean, too.
    """
    choice = rough.push(offset=offset, evidence=4)
    assert rough.outcomes.expected(choice.kind, choice.stroke, 1.0 + rough.belief.next_sd(4)) > 1e-3  # mm


def test_kept_and_loaded(heavy, tmp_path):
    heavy.save(tmp_path / "strategy.nc")
    again = Strategy.from_file(tmp_path / "strategy.nc")
    assert again.dataset.identical(heavy.dataset)
    assert again == heavy
    assert again != again.problem
    for offset in (0.004, 0.1, 7.0):
        assert again.push(offset=offset, friction=1.05, evidence=2) == heavy.push(
            offset=offset, friction=1.05, evidence=2
        )


def test_a_value_between_nodes_lies_between_them(light):
    nodes = light.dataset.offset.values
    for k in (2, 13, 31):
        ends = [light.value(offset=float(nodes[k + i])) for i in (0, 1)]
        assert (
            min(ends) - 1e-12
            <= light.value(offset=float(np.sqrt(nodes[k] * nodes[k + 1])))
            <= max(ends) + 1e-12
        )
    assert light.value(offset=light.finish) == 0.0


def test_pictures(heavy, light):
    assert len(heavy.plot().axes) == 5  # four, and the bar of colours
    assert len(light.simulate(runs=5, rng=0).plot().axes) == 3


def test_a_tolerance_below_half_the_quantum_is_told():
    with (
        pytest.warns(
            UserWarning, match=r"tolerance of 2.5 µm is below half the jump of stick and slip, 7.72 µm"
        ),
        pytest.raises(_Enough),
    ):
        plan(HEAVY, progress=_stop)
    with warnings.catch_warnings(), pytest.raises(_Enough):
        warnings.simplefilter("error")
        plan(LIGHT, progress=_stop)


class _Enough(Exception):
    pass


def _stop(share, text):
    raise _Enough


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"spindle_speed": -1.0}, r"spindle_speed must be > 0 \(rad/s\); got -1.0"),
        ({"spindle_speed": "fast"}, "spindle_speed must be one of"),
        ({"spindle_speed": float("nan")}, "spindle_speed must be"),
        ({"spindle_speed": 1e4}, r"spindle_speed must be <= spindle_speed_max = 10.472 \(rad/s\); got 10000"),
    ],
)
def test_bad_input_is_refused(arguments, message):
    with pytest.raises(ValueError, match=message):
        plan(LIGHT, **arguments)


def test_what_a_strategy_refuses(light):
    with pytest.raises(
        ValueError, match=r"offset must be > 0.00205, at which the part is centred \(mm\); got 0.001"
    ):
        light.push(offset=0.001)
    with pytest.raises(ValueError, match=r"start must be in \(0, 10\] \(mm\); got 11.0"):
        light.simulate(runs=2, start=11.0)
    with pytest.raises(ValueError, match="runs must be"):
        light.simulate(runs=0)
    with pytest.raises(ValueError, match=r"push_speed must be > 0 \(mm/s\)"):
        PushKind("gentle", 0.0, True)
    with pytest.raises(ValueError, match="part_sd must be >= 0"):
        FrictionScaleBelief(-0.1, 0.04)


def test_table_speeds():
    offsets = np.array([0.01, 1.0, 10.0])
    scheduled = table_speeds(HEAVY, offsets, "scheduled")
    assert scheduled[0] == HEAVY.limits.spindle_speed_max
    assert np.all(np.diff(scheduled) <= 0)
    np.testing.assert_array_equal(table_speeds(HEAVY, offsets, 3.0), np.minimum(3.0, scheduled))


@pytest.mark.parametrize("which", ["printed", "identified"])
@pytest.mark.parametrize("mass", [0.8, 18.9])
def test_table_speeds_are_within_the_limits_of_the_push(which, mass):
    """Friction at rest, table, samples in a turn, and what the slide could follow."""
    problem = preset(which).replace(mass=mass)
    offsets = np.geomspace(2e-3, 1.5 * problem.offset_max, 40)
    limits = [spindle_speed_limit(problem, offset=float(offset)).value for offset in offsets]
    assert np.all(table_speeds(problem, offsets, "scheduled") <= np.array(limits) * (1 + 1e-9))


def test_a_slower_table_takes_longer(few):
    slow = quick_strategy(HEAVY, kinds=FEW, size=Size(16, 3), spindle_speed=2.0)
    assert slow.cycle_time(1.0) > 1.5 * few.cycle_time(1.0)


def test_evidence_and_standard_deviation_are_inverse():
    belief = FrictionScaleBelief(0.08, 0.04)
    for pushes in (0.0, 0.5, 3.0, 20.0):
        assert belief.evidence(belief.sd(pushes)) == pytest.approx(pushes, abs=1e-9)
    assert belief.sd(3) == pytest.approx(1 / np.sqrt(1 / 0.08**2 + 3 / 0.04**2))
    assert FrictionScaleBelief(0.0, 0.0).next_sd(5) == 0.0


def test_load_knows_the_kind(heavy, tmp_path):
    heavy.save(tmp_path / "strategy.nc")
    assert isinstance(sdpgrind.load(tmp_path / "strategy.nc"), Strategy)


@pytest.mark.parametrize("offset", [15.1, 30.0, 3000.0])
def test_an_offset_beyond_the_strategy_is_refused(light, offset):
    for ask in (light.push, light.value):
        with pytest.raises(
            ValueError, match=rf"offset must be <= 15 \(the strategy's\) \(mm\); got {offset}"
        ):
            ask(offset=offset)
    with pytest.raises(ValueError, match="offset must be <= 15"):
        light.cycle_time(offset)
    assert np.isfinite(light.push(offset=light.offset_max).stroke)


def test_a_strategy_cannot_be_changed_from_outside(light):
    before = light.push(offset=1.0), light.value(offset=1.0)
    for variable in light.dataset.variables.values():
        if variable.values.flags.writeable and variable.values.dtype.kind in "fi":
            variable.values[:] = 0
    assert (light.push(offset=1.0), light.value(offset=1.0)) == before
    given = light._speeds.copy()
    one = Strategy(light.problem, light.outcomes, given, (light._value, light._kind, light._share))
    given[:] = 0.0
    assert one == light and one.push(offset=1.0).spindle_speed > 0.0


def test_tables_are_equal_by_value_and_say_what_they_are_in_a_line(light):
    table = light.outcomes
    assert table == table.replace(travel=table.travel.copy()) and hash(table) == hash(
        table.replace(travel=table.travel.copy())
    )
    assert table != table.replace(travel=table.travel + 1e-9)
    assert (
        repr(table)
        == f"OutcomeTable({len(table.kinds)} kinds of push, {table.strokes.size} strokes up to {table.strokes[-1]:.4g} mm)"
    )
