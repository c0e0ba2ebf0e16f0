"""Fastest cycle: published and independent numbers, optimality conditions, attempts to be faster."""

import re

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from plunge_inside import Envelope, EnvelopeLimits, _damage, _start_integral
from scipy.integrate import quad, simpson, solve_ivp

from sdpgrind import physics, plunge
from sdpgrind.base.compiling.compiled import opened
from sdpgrind.plunge import kernels

damage = opened(_damage)

NOMINAL = plunge.preset("simulation")


def test_model_against_the_specification():
    model = NOMINAL.model
    np.testing.assert_allclose(
        model.burn_depth([0.003, 0.010, 0.020, 0.0448]), [-0.0101, 0.0046, 0.0316, 0.0882], atol=6e-5
    )
    np.testing.assert_allclose(model.local_time_constant([0.0448, 0.003]), [1.65, 2.02], atol=5e-3)
    assert model.burn_rate == pytest.approx(0.0082569, abs=1e-7)
    assert model.core.K0 / NOMINAL.command_rate_max == pytest.approx(0.236, abs=5e-4)
    assert (NOMINAL.final_rate, NOMINAL.time_constant) == (
        pytest.approx(0.002564, abs=1e-6),
        pytest.approx(1.9334, abs=1e-4),
    )


def test_deflection_and_its_inverse():
    model = NOMINAL.model
    rate = np.geomspace(1e-5, 0.1, 50)
    np.testing.assert_allclose(model.infeed_rate(model.deflection(rate)), rate, rtol=1e-12)
    assert model.infeed_rate(0.5 * model.core.K0) == 0.0
    step = 1e-6
    slope = (model.deflection(rate + step * rate) - model.deflection(rate)) / (step * rate)
    np.testing.assert_allclose(slope, model.local_time_constant(rate), rtol=1e-5)


@pytest.mark.parametrize(
    ("changes", "margin", "time"),
    [({}, 0.0, 12.0195), ({}, 0.02, 13.4598), ({"wear_flat_area": 0.032}, 0.0, 12.9187)],
)
def test_least_times(changes, margin, time):
    """Of an independent program; the specification's other two methods agree to 1e-4."""
    best = plunge.plan(NOMINAL.replace(**changes), safety_margin=margin)
    assert best.time == pytest.approx(time, abs=1e-4)
    assert best.error < 1e-5


def test_without_burning_it_is_two_pieces():
    cold = NOMINAL.replace(burning=physics.BurningLimit(6.205, 10.0))
    best = plunge.plan(cold)
    assert best.time == pytest.approx(11.8620, abs=1e-4)
    assert len(best.switches) == 2


def test_without_any_damage():
    """A margin of nearly the whole stock: the burn rate until spark-out."""
    assert plunge.plan(NOMINAL, safety_margin=0.2819).time == pytest.approx(35.546, abs=1e-3)


def test_end_of_full_rate():
    assert plunge.plan(NOMINAL).switches[0] == pytest.approx(6.350, abs=2e-3)


@pytest.fixture(scope="module")
def best():
    return plunge.plan(NOMINAL)


def test_the_course_obeys_its_dynamics(best):
    """x' = u - v and q' = v, integrated with the plan's commands."""
    t, model = best.trajectory, NOMINAL.model
    command, time = t.command_rate.values, t.time.values

    def slope(now, state):
        rate = float(model.infeed_rate(state[0]))
        return [np.interp(now, time, command) - rate, -rate]

    for low, high in zip((0.0, *best.switches[:-1]), best.switches, strict=True):
        inside = (time > low + 1e-9) & (time < high - 1e-9)
        at = time[inside]
        start = [t.deflection.values[inside][0], t.remaining.values[inside][0]]
        done = solve_ivp(slope, (at[0], at[-1]), start, t_eval=at, rtol=1e-9, atol=1e-12, max_step=0.02)
        np.testing.assert_allclose(done.y[0], t.deflection.values[inside], atol=2e-5)
        np.testing.assert_allclose(done.y[1], t.remaining.values[inside], atol=2e-5)


def test_no_limit_is_broken_and_each_binds(best):
    t = best.trajectory
    rate, left, burn = t.infeed_rate.values, t.remaining.values, t.burn_depth.values
    touching = rate > 0.001
    assert np.all(burn[touching] <= left[touching] + 1e-12)
    tracking = t.piece.values == 4
    np.testing.assert_allclose(burn[tracking], left[tracking], atol=1e-12)
    assert rate[-1] == pytest.approx(NOMINAL.final_rate, rel=1e-10) and left[-1] == pytest.approx(
        0.0, abs=1e-12
    )
    assert np.all((t.command_rate.values >= 0) & (t.command_rate.values <= NOMINAL.command_rate_max + 1e-15))
    assert best.roundness == pytest.approx(3e-3, rel=1e-9)


def test_command_is_used_up(best):
    """Conservation: command = removed stock + deflection."""
    t = best.trajectory
    inside = np.diff(t.time.values) > 0
    commanded = np.sum(
        (0.5 * (t.command_rate.values[1:] + t.command_rate.values[:-1]) * np.diff(t.time.values))[inside]
    )
    assert commanded == pytest.approx(NOMINAL.stock + float(t.deflection[-1]), abs=2e-4)


def test_time_is_the_integral_of_the_stock(best):
    """By Simpson's rule in each piece; at the start only where 1/v is smooth enough."""
    t, begin = best.trajectory, 0.0
    for end in best.switches:
        inside = (t.time.values > begin + 1e-9) & (t.time.values < end - 1e-9) & (t.infeed_rate.values > 4e-3)
        inside |= (t.time.values > 7.0) & (t.time.values > begin + 1e-9) & (t.time.values < end - 1e-9)
        left, rate, time = t.remaining.values[inside], t.infeed_rate.values[inside], t.time.values[inside]
        assert simpson(1 / rate[::-1], x=left[::-1]) == pytest.approx(time[-1] - time[0], rel=1e-5)
        begin = end


random_cycles = given(
    rate_max=st.floats(0.03, 0.09), B=st.floats(3.0, 7.2), stock=st.floats(0.15, 0.4), stiffness=st.floats(4e3, 3e4),
    area=st.floats(0.008, 0.032), margin=st.floats(0.0, 0.05), roundness=st.floats(2e-3, 6e-3),
)  # fmt: skip


@settings(max_examples=40, deadline=None)
@random_cycles
def test_bound_against_a_running_minimum(rate_max, B, stock, stiffness, area, margin, roundness):
    """Y~(r) = min over s <= r of Y(s) + r - s, on a fine grid, and its limits."""
    try:
        problem = NOMINAL.replace(
            command_rate_max=rate_max, burning=physics.BurningLimit(6.205, B), stock=stock, stiffness=stiffness,
            wear_flat_area=area, sample_time=1e-3, roundness_max=roundness,
        )  # fmt: skip
    except ValueError:
        assume(False)
    model, margin = problem.model, min(margin, 0.9 * stock)
    limits = EnvelopeLimits(model.core, rate_max, model.burn_rate, problem.final_rate, margin, stock)
    envelope = Envelope(limits)
    left = np.linspace(0.0, stock, 2001)
    rate = np.array([limits.rate_at(r) for r in left])
    rate[0] = min(rate[0], problem.final_rate)
    y = _beyond(model, rate)
    np.testing.assert_allclose(
        [envelope(r) for r in left], np.minimum.accumulate(y - left) + left, atol=2 * stock / 2000
    )
    t = plunge.plan(problem, safety_margin=margin).trajectory
    burning = t.infeed_rate.values > model.burn_rate
    assert np.all(
        t.burn_depth.values[burning] <= np.maximum(t.remaining.values[burning] - margin, 0.0) + 1e-10
    )
    assert np.all(np.diff(t.time.values) >= -1e-12) and np.all(np.diff(t.remaining.values) <= 1e-12)
    assert t.infeed_rate.values[-1] <= min(problem.final_rate, rate_max) * (1 + 1e-9)


def _kept(problem, command, sample):
    """Time (s) of held commands on the simulated part, between samples; None: a limit is broken."""
    rig, state = kernels.rig(problem.model, problem.stock, sample), np.zeros(kernels.STATES)
    kernels.start_part(state, rig)
    for k, u in enumerate(command):
        left, rate = state[kernels.REMAINING], state[kernels.RATE]
        kernels.advance(state, rig, float(u))
        if damage(state[kernels.RATE], rig.core) > max(state[kernels.REMAINING], 0.0) + 1e-9:
            return None
        if state[kernels.REMAINING] <= 0:
            share = left / (left - state[kernels.REMAINING])
            end = rate + share * (state[kernels.RATE] - rate)
            return (k + share) * sample if end <= problem.final_rate * (1 + 1e-9) else None
    return None


def test_no_command_within_the_limits_is_faster(best):
    """Commands near and far from the optimum, on the simulated part."""
    sample, rng, t = 0.01, np.random.default_rng(0), best.trajectory
    at = (np.arange(1500) + 0.5) * sample
    command = np.interp(at, t.time.values, t.command_rate.values)
    command[at < best.switches[0]], command[at > best.switches[-2]] = NOMINAL.command_rate_max, 0.0
    times = []
    for _ in range(75):
        middle, width, height = (
            rng.uniform(0, 12),
            rng.uniform(0.02, 3.0),
            rng.normal() * 10 ** rng.uniform(-4.5, -2),
        )
        tried = (command + height * np.exp(-0.5 * ((at - middle) / width) ** 2)) * (
            1 - 10 ** rng.uniform(-6, -2.5)
        )
        times.append(_kept(NOMINAL, np.clip(tried, 0.0, NOMINAL.command_rate_max), sample))
    kept = [time for time in times if time is not None]
    assert 20 < len(kept) < 70
    assert best.time < min(kept) < 1.001 * best.time


def _beyond(model, rate):
    return model.deflection(rate) - model.core.K0


def test_saved_and_loaded(best, tmp_path):
    import sdpgrind

    best.save(tmp_path / "cycle.nc")
    again = sdpgrind.load(tmp_path / "cycle.nc")
    assert (again.time, again.problem, again.switches, again.error) == (
        best.time,
        best.problem,
        best.switches,
        best.error,
    )
    np.testing.assert_array_equal(again.trajectory.infeed_rate, best.trajectory.infeed_rate)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"wheel_diameter": 70.0}, r"wheel_diameter must be < work_diameter = 70 in a bore \(mm\); got 70.0"),
        ({"wheel_speed": 37.0}, r"wheel_speed must be in mm/s, .*units.m_per_s.*; got 37.0"),
        ({"work_rotation": 400.0}, r"work_rotation must be in rad/s, .*units.rpm.*; got 400.0"),
        ({"wear_flat_area": 1.5}, r"wear_flat_area must be in \(0, 1\]; got 1.5"),
        ({"stock": 282.0}, r"stock must be radial and in mm, < work_diameter/4; units.um.* got 282.0"),
        ({"command_rate_max": 44.8}, r"command_rate_max must be in mm/s, some 0.05; units.um.* got 44.8"),
        (
            {"command_rate_max": 0.45, "work_rotation": 2.0},
            r"must be less than 1 mm a turn of the work \(mm/s\); got 0.45",
        ),
        ({"stock": -0.1}, r"stock must be > 0 \(mm\); got -0.1"),
        (
            {"roundness_max": 1e-3},
            r"roundness_max must be > roundness_base = 0.00159: no rate is round enough \(mm\)",
        ),
        ({"sample_time": 1.0}, r"sample_time must be <= time_constant/4 = 0.4834 \(s\); got 1.0"),
        (
            {"burning": physics.BurningLimit(6.2, 0.5)},
            r"burning.B must be >= 2.84 .*, or >= 2.03 with a new wheel: .* burns at every infeed rate",
        ),
    ],
)
def test_problems_that_are_none(changes, message):
    with pytest.raises(ValueError, match=message):
        NOMINAL.replace(**changes)


SHAFT = {"internal": False, "wheel_diameter": 400.0, "work_diameter": 40.0}


@pytest.mark.parametrize("changes", [SHAFT, {"wear_flat_area": 0.09}], ids=["any wheel", "a worn wheel"])
def test_the_limits_of_a_work_that_always_burns_do(changes):
    """Problems with the limits of the message exist; with 1 % less than these they do not."""
    with pytest.raises(ValueError, match="burns at every infeed rate") as refused:
        NOMINAL.replace(**changes)
    limit = {
        key: float(value)
        for key, value in re.findall(r"(B|area)(?: must be)? [<>]= ([\d.]+)", str(refused.value))
    }
    B = limit.pop("B")
    assert NOMINAL.replace(**changes, burning=NOMINAL.model.burning.replace(B=B)).model.burn_rate > 0
    with pytest.raises(ValueError, match="burns at every"):
        NOMINAL.replace(**changes, burning=NOMINAL.model.burning.replace(B=0.99 * B))
    for area in limit.values():
        assert NOMINAL.replace(wear_flat_area=area).model.burn_rate > 0
        with pytest.raises(ValueError, match="burns at every"):
            NOMINAL.replace(wear_flat_area=1.01 * area)
    assert bool(limit) == ("wear_flat_area" in changes)


def test_the_limit_of_a_new_wheel_is_enough_for_it_alone():
    with pytest.raises(ValueError, match="even with wear_flat_area = 0") as refused:
        NOMINAL.replace(**SHAFT)
    (new,) = re.findall(r"or >= ([\d.]+) with a new wheel", str(refused.value))
    burning = NOMINAL.model.burning.replace(B=float(new))
    assert NOMINAL.replace(**SHAFT, burning=burning, wear_flat_area=1e-5).model.burn_rate > 0
    with pytest.raises(ValueError, match="burns at every"):
        NOMINAL.replace(**SHAFT, burning=burning)


def test_kinds_that_are_none():
    with pytest.raises(TypeError, match=r"internal must be a bool; got 'no'"):
        NOMINAL.replace(internal="no")
    with pytest.raises(TypeError, match=r"sliding must be a sliding law, such as physics.DongSliding"):
        physics.GrindingPower(sliding="dong")


def test_margins_that_are_none():
    with pytest.raises(ValueError, match=r"safety_margin must be >= 0 \(mm\)"):
        plunge.plan(NOMINAL, safety_margin=-0.01)
    with pytest.raises(ValueError, match=r"safety_margin must be < stock = 0.282 \(mm\)"):
        plunge.plan(NOMINAL, safety_margin=0.3)
    with pytest.raises(TypeError, match="problem must be a CycleProblem"):
        plunge.plan("simulation")


def test_a_warning_points_at_the_line_of_who_caused_it():
    """A call, a change, and a change of a change: the same line of this file."""
    simulation = plunge.preset("simulation")
    with pytest.warns(UserWarning, match="no spark-out is needed") as told:
        slow = simulation.replace(command_rate_max=7e-4)
        plunge.CycleProblem(simulation.model, stock=0.282, command_rate_max=7e-4, roundness_max=0.003)
        slow.replace(wear_flat_area=0.02)
    assert len(told) == 3 and {warning.filename for warning in told} == {__file__}


def test_warnings():
    with pytest.warns(UserWarning, match="an area of one sliding law is none of another"):
        NOMINAL.replace(
            power=physics.GrindingPower(sliding=physics.MalkinSliding()),
            burning=physics.BurningLimit(6.2, 70.0),
        )
    with pytest.warns(UserWarning, match="no spark-out is needed"):
        NOMINAL.replace(command_rate_max=0.002)


@pytest.mark.parametrize(
    ("rate_max", "stock", "roundness"), [(0.0448, 0.004, 12e-3), (0.0125, 0.01, 8e-3), (0.1, 0.05, 40e-3)]
)
def test_stock_that_is_gone_before_any_limit_is_met(rate_max, stock, roundness):
    """Full rate to the end, as by an integrator; a later bound is ignored."""
    thin = NOMINAL.replace(
        stock=stock, command_rate_max=rate_max, roundness_max=roundness, burning=physics.BurningLimit(6.205, 12.0),
        sample_time=1e-3, time_constant=None,
    )  # fmt: skip
    model, best = thin.model, plunge.plan(thin)

    def gone(_, state):
        return state[1] - stock

    gone.terminal = True

    def slope(_, state):
        rate = float(model.infeed_rate(state[0]))
        return [rate_max - rate, rate]

    found = solve_ivp(slope, (0, 100), [0.0, 0.0], events=gone, rtol=1e-10, atol=1e-13)
    assert best.time == pytest.approx(found.t_events[0][0], rel=1e-7) and best.error < 1e-9
    last = best.trajectory.isel(time=-1)
    assert float(last.remaining) == 0.0 and float(last.infeed_rate) < thin.final_rate
    assert float(last.infeed_rate) == pytest.approx(float(model.infeed_rate(found.y[0, -1])), rel=1e-6)
    assert float(best.trajectory.remaining.min()) == 0.0


@pytest.mark.parametrize("p", [0.5, 0.85, 1.0])
def test_start_that_comes_near_the_full_rate(p):
    """Time of the start to exp(-lag) below full rate, by quadrature; p = 1: closed form."""
    lag = np.array([1e-3, 1.0, 7.99, 8.01, 15.0, 30.0])
    got = _start_integral(p, lag) * (-np.expm1(-lag)) ** p
    if p == 1.0:
        np.testing.assert_allclose(got, lag, rtol=1e-12)
    by_parts = [
        quad(lambda x: p * (-np.expm1(-x)) ** (p - 1), 0, end, epsabs=0, epsrel=1e-11, limit=200)[0]
        for end in lag
    ]
    np.testing.assert_allclose(got, by_parts, rtol=1e-9)
