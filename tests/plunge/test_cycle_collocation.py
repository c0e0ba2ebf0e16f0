"""Cycles by collocation against exact cycles, brute force over rotations, and dynamic programming."""

import subprocess
import sys
import warnings
from functools import cache

import numpy as np
import pytest
from cycle_sets import NOMINAL, play, problem
from plunge_inside import allowed_rate, burn_depth, burns_always, collocation, coolest_rate, core_at
from plunge_inside import dp as _dp

from sdpgrind import physics, plunge, units

RANGE = (units.hz(2), units.hz(8))


@cache
def collocated(number=0, **options):
    """Each is solved once."""
    return plunge.plan(problem(number), method="collocation", **options)


@pytest.mark.parametrize(("number", "margin"), [(0, 0.0), (3, 0.0), (5, 0.0), (3, 0.03), (8, 0.03)])
def test_near_the_exact_time_and_never_below(number, margin):
    """The bar is 2.5e-3; the exact time is the least."""
    exact = plunge.plan(problem(number), safety_margin=margin)
    best = collocated(number, **{"safety_margin": margin} if margin else {})
    assert exact.time <= best.time * (1 + 1e-6)
    assert best.time == pytest.approx(exact.time, rel=3e-4)
    assert best.time - exact.time <= best.error < 1e-3 * exact.time
    assert best.solution.ok and best.solution.residual < 1e-7 and best.solution.excess < 2e-5  # mm
    assert best.binding == exact.binding and best.roundness <= problem(number).roundness_max * (1 + 1e-6)


def test_end_so_slow_that_ploughing_alone_would_seem_to_burn():
    """The final rate lies below the lower root of burning, an artefact."""
    fine = NOMINAL.replace(roundness_max=units.um(1.6))
    assert fine.final_rate < fine.model.burn_onset[0]
    assert plunge.plan(fine, method="collocation", steps=60).time == pytest.approx(
        plunge.plan(fine).time, rel=2e-3
    )


def test_order_of_convergence():
    """Second: a sixteenth of the error with four times the intervals (240), but for corners."""
    exact = plunge.plan(problem(3)).time
    coarse, fine = (collocated(3, **asked).time - exact for asked in ({"steps": 60}, {}))
    assert 0 < fine < coarse / 10


def test_start_does_not_matter():
    """From a course of twice the time, and of half the rate."""
    job = collocation.task(NOMINAL, 0.0, (NOMINAL.model.work_rotation,) * 2, 60)
    plain = collocation.guess(job)
    slow = plain._replace(time=2 * plain.time, ends=2 * plain.ends, rate=0.5 * plain.rate, y=0.5 * plain.y)
    times = [collocation.solve(job, start).commands.duration.sum() for start in (plain, slow)]
    assert times[0] == pytest.approx(times[1], rel=1e-4)


def test_residual_sees_what_is_no_solution(monkeypatch):
    """An interrupted iteration violates the conditions."""
    monkeypatch.setitem(collocation.IPOPT, "max_iter", 8)
    job = collocation.task(NOMINAL, 0.0, (NOMINAL.model.work_rotation,) * 2, 30)
    stopped = collocation.solve(job, collocation.guess(job))
    assert stopped.residual > 1e-4 and stopped.message == "not solved: IPOPT says Maximum_Iterations_Exceeded"


@pytest.mark.parametrize("changes", [{}, {"wear": plunge.Wear(0.03, 1.0, 0.02)}])
def test_commands_played_by_another_integrator(changes):
    changed = NOMINAL.replace(**changes)
    best = plunge.plan(changed, method="collocation", steps=60) if changes else collocated(steps=60)
    t, (ends, states) = best.trajectory, play(best)
    np.testing.assert_allclose(t.deflection.values[ends] - NOMINAL.model.core.K0, states[:, 0], atol=1e-6)
    np.testing.assert_allclose(t.remaining.values[ends], np.maximum(states[:, 1], 0.0), atol=1e-6)
    np.testing.assert_allclose(t.wear_flat_area.values[ends], states[:, 2], atol=1e-7)


# -- wear


def test_wear_in_proportion_to_the_stock_as_by_dynamic_programming():
    worn = NOMINAL.replace(wear=plunge.Wear(0.03))
    stages = plunge.plan(worn, method="dp", steps=120)
    best = plunge.plan(worn, method="collocation", steps=120)
    assert best.time == pytest.approx(stages.time, rel=2e-4)
    assert best.time >= stages.time * (1 - 3e-5)


def test_wear_that_fades_gives_the_time_without():
    def time(problem):
        return plunge.plan(problem, method="collocation", steps=60).time

    times = [time(NOMINAL.replace(wear=plunge.Wear(g, 1.0))) for g in (1e-8, 0.01, 0.03)]
    assert times[0] == pytest.approx(collocated(steps=60).time, rel=1e-5)
    assert times[0] < times[1] < times[2]


def test_area_is_what_the_law_of_wear_adds_up_to():
    wear = plunge.Wear(0.02, 0.5, 0.02)
    t = plunge.plan(NOMINAL.replace(wear=wear), method="collocation", steps=60).trajectory
    left, rate = t.remaining.values, t.infeed_rate.values
    grown = np.trapezoid(wear.growth * (rate / wear.reference_rate) ** wear.exponent, -left)
    assert float(t.wear_flat_area[-1]) - NOMINAL.model.wear_flat_area == pytest.approx(grown, rel=1e-4)
    dull = NOMINAL.model.replace(wear_flat_area=float(t.wear_flat_area[-1]))
    assert float(t.grinding_power[-1]) == pytest.approx(float(dull.grinding_power(rate[-1])), rel=1e-12)


def test_a_wheel_that_wears_more_when_fed_faster_is_spared():
    """Of two laws with equal wear at 0.02 mm/s, the steeper one leads to a slower feed."""
    plain, steep = (
        plunge.plan(NOMINAL.replace(wear=plunge.Wear(0.02, exponent, 0.02)), method="collocation", steps=60)
        for exponent in (0.0, 2.0)
    )
    assert float(steep.trajectory.infeed_rate.max()) < 0.97 * float(plain.trajectory.infeed_rate.max())


# -- the rotation of the work


def malkin():
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        return NOMINAL.replace(
            power=physics.GrindingPower(sliding=physics.MalkinSliding()), wear_flat_area=0.0059,
            burning=physics.BurningLimit(6.205, 4.2),
        )  # fmt: skip


@pytest.fixture(scope="module")
def turned():
    return plunge.plan(malkin(), method="collocation", work_rotation_range=RANGE, steps=120)


def test_range_of_one_rotation_gives_the_exact_time():
    for rotation in (NOMINAL.model.work_rotation, units.hz(4)):
        exact = plunge.plan(NOMINAL.replace(work_rotation=rotation)).time
        best = plunge.plan(NOMINAL, method="collocation", work_rotation_range=(rotation, rotation), steps=120)
        assert exact * (1 - 1e-6) <= best.time <= exact * (1 + 1e-3)
        assert np.all(best.trajectory.work_rotation == rotation)


def test_narrow_range_gives_nearly_the_exact_time():
    rotation = malkin().model.work_rotation
    best = plunge.plan(
        malkin(), method="collocation", work_rotation_range=(rotation, 1.0001 * rotation), steps=120
    )
    assert best.time == pytest.approx(plunge.plan(malkin()).time, rel=2e-4)


def test_no_constant_rotation_is_as_fast(turned):
    """Brute force: the exact time at each of many rotations."""
    constant = [_constant(rotation) for rotation in np.linspace(*RANGE, 13)]
    assert turned.time < 0.9 * min(constant)
    assert turned.solution.ok and np.isfinite(turned.error)


def _constant(rotation):
    try:
        return plunge.plan(malkin().replace(work_rotation=float(rotation), time_constant=None)).time
    except ValueError:  # burns at every rate
        return np.inf


def by_grids(problem, rotations, stages=60, nodes=150):
    """Least time over grids of stock, deflection and rotation, free in each stage: a global minimum."""
    model, u = problem.model, problem.command_rate_max
    left, cores = _dp.stock_nodes(problem, 0.0, stages), [core_at(model, float(n)) for n in rotations]
    limit = np.array([_greatest(problem, core, n, left) for core, n in zip(cores, rotations, strict=True)])
    most = np.minimum.accumulate(limit.max(axis=0) - left) + left
    ground, share = _dp.StageModel(problem, 0.0, 3), np.linspace(0.0, 1.0, nodes)
    value = np.zeros(nodes)
    for k in range(1, stages + 1):
        y, drop, best = share * most[k], left[k] - left[k - 1], np.full(nodes, np.inf)
        for core, bound in zip(cores, limit, strict=True):
            top, rate = min(most[k - 1], bound[k - 1]), _dp._rates(y, core)
            least = np.maximum(y - drop, 0.0)
            greatest = np.maximum(
                np.minimum(ground._full(y, rate, drop, core, most[k - 1]), top), np.minimum(least, top)
            )
            allowed = (y <= bound[k] * (1 + 1e-9)) & (least <= top * (1 + 1e-9))
            for spared in (0.0, 0.3, 1.0):
                after = greatest - spared * (greatest - np.minimum(least, greatest))
                time = drop / np.maximum(_dp.mean_rate(rate, _dp._rates(after, core), core), 1e-12)
                best = np.minimum(
                    best, np.where(allowed, time + np.interp(after / most[k - 1], share, value), np.inf)
                )
        value = best
    return value[0] + model.core.K0 / u


def _greatest(problem, core, rotation, left):
    """Greatest deflection (mm) within burning and, at the end, roundness."""
    rate = allowed_rate(core, left, 10 * problem.command_rate_max)
    if burns_always(core):
        rate[left < burn_depth(coolest_rate(core), core)] = 0.0
    rate[0] = min(rate[0], problem.final_rate * rotation / problem.model.work_rotation)
    return core.K1 * rate + core.K2 * rate**core.p


def test_near_the_least_of_all_local_minima(turned):
    """A coarse grid is some 1 % slow; its free rotation in the last instant gains almost nothing."""
    grids = by_grids(malkin(), np.linspace(*RANGE, 13))
    assert 0.98 * grids < turned.time < grids


def test_limits_are_kept_at_every_rotation(turned):
    """By models built anew at each rotation."""
    t, most = turned.trajectory, malkin().roundness_max
    low, high = RANGE
    assert np.all((t.work_rotation >= low * (1 - 1e-9)) & (t.work_rotation <= high * (1 + 1e-9)))
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        for k in range(0, t.time.size, 37):
            here, rate = (
                malkin().model.replace(work_rotation=float(t.work_rotation[k])),
                float(t.infeed_rate[k]),
            )
            if rate > here.burn_rate > 0:
                assert float(here.burn_depth(rate)) <= float(t.remaining[k]) + 5e-6
    last = malkin().model.replace(work_rotation=float(t.work_rotation[-1]))
    assert float(last.roundness(float(t.infeed_rate[-1]))) <= most * (1 + 1e-6)
    assert turned.roundness == pytest.approx(most, rel=1e-6)


def test_last_turn_is_of_one_rotation(turned):
    t = turned.trajectory
    turn = 2 * np.pi / float(t.work_rotation[-1])
    inside = t.time.values > turned.time - 0.999 * turn
    np.testing.assert_allclose(t.work_rotation.values[inside], float(t.work_rotation[-1]), rtol=1e-6)


def test_saved_and_loaded(turned, tmp_path):
    import sdpgrind

    turned.save(tmp_path / "cycle.nc")
    again = sdpgrind.load(tmp_path / "cycle.nc")
    assert (again.solution, again.status, again.roundness) == (
        turned.solution,
        turned.status,
        turned.roundness,
    )


# -- what cannot be solved


def test_a_solver_that_fails(monkeypatch):
    monkeypatch.setitem(collocation.IPOPT, "max_iter", 8)
    words = "problem must be one that method 'collocation' can solve; it was not solved: IPOPT says Maximum_Iterations_Exceeded"
    with pytest.raises(
        plunge.CycleError, match=words + " after 8 iterations with 40 steps: try other steps"
    ) as caught:
        plunge.plan(NOMINAL, method="collocation", steps=40)
    assert np.isfinite(caught.value.plan.time) and caught.value.plan.error == np.inf
    again = plunge.plan(NOMINAL, method="collocation", steps=40, throw=False)
    assert not again.solution.ok and again.status == caught.value.plan.status
    assert not np.any(np.isnan(again.trajectory.infeed_rate)) and not np.any(
        np.isnan(again.trajectory.burn_depth)
    )


@pytest.mark.parametrize(
    ("asked", "message"),
    [
        ((40.0, 20.0), r"work_rotation_range must rise, up to 300 at most \(rad/s\); got \(40.0, 20.0\)"),
        ((40.0, 600.0), r"work_rotation_range must rise, up to 300 at most \(rad/s\); got \(40.0, 600.0\)"),
        ((0.0, 20.0), r"work_rotation_range\[0\] must be > 0 \(rad/s\); got 0.0"),
        (20.0, r"work_rotation_range must be a least and a greatest rotation \(rad/s\); got 20.0"),
    ],
)
def test_ranges_that_are_none(asked, message):
    with pytest.raises(ValueError, match=message):
        plunge.plan(NOMINAL, method="collocation", work_rotation_range=asked)


def test_solvers_are_loaded_when_they_are_needed():
    code = "import sys; from sdpgrind import plunge; plunge.plan(plunge.preset('simulation')); print('casadi' in sys.modules)"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "False"
