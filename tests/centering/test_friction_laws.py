"""The six friction laws: their curves, their loops, the mass under a load, and the creep that only some of
them show.
"""

import numpy as np
import pytest
from circle_inside import LAWS, follow_load
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import solve_ivp

from centering import preset
from centering.friction import (
    CoulombFriction,
    DahlFriction,
    ElastoPlasticFriction,
    LuGreFriction,
    StribeckFriction,
    ViscousFriction,
    friction_drift,
    friction_law,
    simulate_friction,
)

MODEL = preset("printed").model
MASS, INERTIA = 18.9, 0.0189
HELD, SLID = MODEL.breakaway_force, MODEL.coulomb_force
# N: at most half of the breakaway force
CREEP = {"mass": MASS, "mean_load": 0.2 * HELD, "load_amplitude": 0.3 * HELD}
SPEEDS = st.floats(-100.0, 100.0)


def law_of(name, **options):
    return friction_law(MODEL, name, **options)


@given(v=SPEEDS.filter(lambda v: abs(v) > 1e-12))
def test_steady_force_of_every_law(v):
    """At a speed that lasts all laws give their curve, with the sign of the speed."""
    kinetic, drag = MODEL.coulomb_force, 0.1 * abs(v)
    fade = (HELD - kinetic) * np.exp(-(v**2))
    steady = {"coulomb": kinetic, "viscous": kinetic + drag, "stribeck": kinetic + fade + drag}
    steady |= {"dahl": kinetic, "lugre": kinetic + fade + drag, "elasto_plastic": kinetic + fade + drag}
    for name in LAWS:
        law = law_of(name)
        z = (
            np.sign(v) * (kinetic + (fade if name in ("lugre", "elasto_plastic") else 0.0)) / 1.2e5
            if law.states
            else 0.0
        )
        assert float(law.force(v, z)) == pytest.approx(np.sign(v) * steady[name], rel=1e-9)
        assert float(law.rate(v, z)) == pytest.approx(0.0, abs=1e-9 * abs(v))


@given(load=st.floats(-100.0, 100.0))
def test_at_rest_friction_balances_up_to_breakaway(load):
    for name in ("coulomb", "viscous", "stribeck"):
        assert float(law_of(name).force(0.0, applied=load)) == np.clip(load, -HELD, HELD)


@given(v=SPEEDS, z=st.floats(-5e-4, 5e-4))
def test_what_a_law_takes_from_the_motion_it_does_not_give_back(v, z):
    """F v is stored power plus a loss >= 0; with a damped bond these laws may not be passive."""
    for name in ("dahl", "lugre", "elasto_plastic"):
        law = law_of(name) if name == "dahl" else law_of(name, bristle_damping=0.0)
        stored = law.bristle_stiffness * z * float(law.rate(v, z))
        assert float(law.force(v, z)) * v - stored >= -1e-9 * max(1.0, abs(stored))


def test_stribecks_exponent_and_speed():
    law = StribeckFriction(HELD, SLID, stribeck_speed=3.0, stribeck_exponent=1.0)
    assert float(law.force(3.0)) == pytest.approx(SLID + (HELD - SLID) / np.e)
    assert float(law.force(-1e-12)) == pytest.approx(-HELD)


def test_yielding_of_the_elastic_law():
    law = law_of("elasto_plastic")
    limit, slides = law.elastic_limit, float(law.stribeck(0.1)) / law.bristle_stiffness
    assert limit == pytest.approx(0.8 * SLID / 1.2e5) and limit == pytest.approx(1.85e-4, abs=1e-6)
    z = np.array([0.0, limit, 0.5 * (limit + slides), slides, 2 * slides])
    assert law.yielding(0.1, z) == pytest.approx([0, 0, 0.5, 1, 1], abs=1e-12)
    assert law.yielding(-0.1, z) == pytest.approx(np.zeros(5)) and law.yielding(-0.1, -z) == pytest.approx(
        law.yielding(0.1, z)
    )


def test_laws_of_arrays_are_those_of_their_entries():
    v, z = np.linspace(-3, 3, 7), np.linspace(-3e-4, 3e-4, 7)
    for name in LAWS:
        law = law_of(name)
        each = [float(law.force(a, b, 20.0)) for a, b in zip(v, z, strict=True)]
        assert law.force(v, z, 20.0) == pytest.approx(each, rel=1e-12)
        assert law.force(v, 0.0).shape == law.rate(v, z).shape == (7,)


def slow_twin(law, load, step, rows):
    """The same steps with the laws' own functions; implicit linear equations by fixed-point iteration."""
    out, x, v, z = [(0.0, 0.0, 0.0, 0.0)], 0.0, 0.0, 0.0
    for push in load[:rows]:
        before = v
        if law.states:
            decay = float(v - law.rate(v, z)) / z if z != 0 else 0.0
            new = v
            for _ in range(400):  # z' = v+ - decay z+, M (v+ - v)/step = push - F(z+, z', v+)
                settled = (z + step * new) / (1 + step * decay)
                damping = getattr(law, "bristle_damping", 0.0) * (settled - z) / step
                force = (
                    law.bristle_stiffness * settled + damping + getattr(law, "viscous_coefficient", 0.0) * new
                )
                new += 0.5 * (v + step * (push - force) / INERTIA - new)
            v, z = new, (z + step * new) / (1 + step * decay)
        else:
            force = float(law.force(v, applied=push))
            if v == 0.0 and abs(push) > HELD:
                force = np.sign(push) * float(law.sliding_force(0.0))
            drag = getattr(law, "viscous_coefficient", 0.0)
            new = (v + step * (push - force + drag * v) / INERTIA) / (1 + step * drag / INERTIA)
            way = np.sign(v) if v else np.sign(push)
            v = new if new * way > 0 and abs(new) > 1e-12 else 0.0
        x += 0.5 * step * (before + v)
        out.append((x, v, push - INERTIA * (v - before) / step, z))
    return np.array(out)


@pytest.mark.parametrize("name", LAWS)
def test_compiled_steps_are_those_of_the_laws(name):
    step = 2e-5 if friction_law(MODEL, name).states else 1e-3
    load = np.concatenate([np.full(60, 30.0), np.full(60, 45.0), np.full(80, -10.0)])
    law, out = law_of(name), np.zeros((201, 4))
    follow_load(law.kind, law.parameters, INERTIA, load, step, 1, out)
    twin = slow_twin(law, load, step, 200)
    assert out == pytest.approx(twin, rel=1e-6, abs=1e-9)
    assert np.abs(out[:, 0]).max() > 1e-5


@pytest.mark.parametrize("name", ["dahl", "lugre", "elasto_plastic"])
def test_laws_with_a_bond_follow_their_equations_to_first_order(name):
    """Against an adaptive integration; half the step, half the error."""
    law, end = law_of(name), 0.1

    def push(t):
        return HELD * (0.2 + 1.1 * np.sin(2 * np.pi * 20 * t))

    def motion(t, y):
        return [y[1], (push(t) - float(law.force(y[1], y[2]))) / INERTIA, float(law.rate(y[1], y[2]))]

    exact = solve_ivp(motion, (0, end), [0, 0, 0], method="LSODA", rtol=1e-9, atol=1e-12).y[0, -1]
    errors = []
    for count in (10_000, 20_000):
        step = end / count
        load = push((np.arange(count) + 0.5) * step)
        errors.append(simulate_friction(law, load, mass=MASS, step=step).position[-1] - exact)
    assert abs(errors[1]) < 0.02 * abs(exact) and errors[0] / errors[1] == pytest.approx(2.0, abs=0.25)


def test_laws_without_a_bond_stick_and_slide_exactly():
    """A force above breakaway, then none: v = (F - F_k) t/M, then a stop after v M/F_k."""
    steps = 1e-4
    load = np.concatenate([np.full(100, HELD - 1e-9), np.full(1000, 50.0), np.zeros(2000)])
    trace = simulate_friction(CoulombFriction(HELD, SLID), load, mass=MASS, step=steps)
    speed = (50.0 - SLID) * 0.1 / INERTIA
    assert trace.position[100] == 0.0 and trace.velocity[1100] == pytest.approx(speed)
    stop = np.flatnonzero(trace.velocity > 0)[-1] * steps - 0.11
    assert stop == pytest.approx(speed * INERTIA / SLID, abs=2 * steps)
    assert trace.position[-1] == pytest.approx(0.5 * speed * 0.1 + 0.5 * speed**2 * INERTIA / SLID, rel=2e-3)
    assert trace.position[-1] == trace.position[-200]


@settings(max_examples=25, deadline=None)
@given(name=st.sampled_from(LAWS), force=st.floats(0.0, 100.0), seed=st.integers(0, 100))
def test_momentum_is_the_sum_of_the_forces(name, force, seed):
    load = force * np.random.default_rng(seed).uniform(-1, 1, 50).repeat(20)
    trace = simulate_friction(law_of(name), load, mass=MASS, step=5e-6)
    gained = np.cumsum((trace.load - trace.friction)[1:]) * 5e-6
    assert INERTIA * trace.velocity[1:] == pytest.approx(gained, abs=1e-9 * (1 + force))
    assert np.isfinite(trace.position).all()


def test_creep_under_a_load_that_should_hold():
    law = law_of("elasto_plastic")
    creep = {name: friction_drift(law_of(name), **CREEP) for name in LAWS}
    assert abs(creep["elasto_plastic"]) < 0.01 * law.elastic_limit
    assert creep["lugre"] > 0.01 and creep["lugre"] == pytest.approx(0.025, abs=1e-3)
    assert creep["dahl"] > 0.01
    assert [creep[name] for name in ("coulomb", "viscous", "stribeck")] == [0.0, 0.0, 0.0]


def test_the_elastic_law_creeps_too_once_it_yields():
    load = CREEP | {"load_amplitude": 0.75 * HELD, "cycles": (5, 20)}  # up to 0.95 F_s: beyond z_ba
    assert friction_drift(law_of("elasto_plastic"), **load) > 1e-4


REFUSED = [
    (lambda: CoulombFriction(20.0, 28.0), "breakaway_force must be >= coulomb_force = 28 (N); got 20.0"),
    (lambda: CoulombFriction(20.0, 0.0), "coulomb_force must be > 0 (N); got 0.0"),
    (lambda: ViscousFriction(37.0, 28.0, -0.1), "viscous_coefficient must be >= 0 (N s/mm); got -0.1"),
    (lambda: StribeckFriction(37.0, 28.0, 0.1, 0.0), "stribeck_speed must be > 0 (mm/s); got 0.0"),
    (
        lambda: StribeckFriction(37.0, 28.0, stribeck_exponent=float("nan")),
        "stribeck_exponent must be finite; got nan",
    ),
    (lambda: DahlFriction(28.0, 0.0), "bristle_stiffness must be > 0 (N/mm); got 0.0"),
    (
        lambda: LuGreFriction(37.0, 28.0, bristle_damping=-1.0),
        "bristle_damping must be >= 0 (N s/mm); got -1.0",
    ),
    (
        lambda: ElastoPlasticFriction(37.0, 28.0, elastic_limit=1e-3),
        "elastic_limit must be < coulomb_force/bristle_stiffness = 0.000233333 (mm); got 0.001",
    ),
    (lambda: friction_law(MODEL, "rubber"), f"law must be one of {', '.join(LAWS)}; got 'rubber'"),
    (
        lambda: simulate_friction(law_of("lugre"), [1.0, np.inf], mass=1.0, step=1e-3),
        "load[1] must be finite (N); got inf",
    ),
    (
        lambda: simulate_friction(law_of("lugre"), [], mass=1.0, step=1e-3),
        "load must be at least one force (N); got []",
    ),
    (
        lambda: simulate_friction(law_of("lugre"), [1.0], mass=0.0, step=1e-3),
        "mass must be > 0 (kg); got 0.0",
    ),
    (lambda: simulate_friction(law_of("lugre"), [1.0], mass=1.0, step=0.0), "step must be > 0 (s); got 0.0"),
    (
        lambda: simulate_friction(law_of("lugre"), [1.0] * 3, mass=1.0, step=1e-3, every=2),
        "steps in all must be a multiple of every = 2, up to 50000000; got 3",
    ),
    (
        lambda: friction_drift(law_of("lugre"), **CREEP, cycles=(3, 3)),
        "cycles must be two rising numbers; got (3, 3)",
    ),
    (lambda: friction_drift(law_of("lugre"), **CREEP, frequency=0.0), "frequency must be > 0 (Hz); got 0.0"),
]


@pytest.mark.parametrize(("call", "message"), REFUSED)
def test_refused(call, message):
    with pytest.raises(ValueError) as caught:
        call()
    assert str(caught.value) == message


def test_a_law_is_asked_for():
    with pytest.raises(TypeError, match=r"law must be a friction law, as friction_law gives it; got 3"):
        simulate_friction(3, [1.0], mass=1.0, step=1e-3)


def test_traces_are_shown():
    trace = simulate_friction(law_of("lugre"), np.full(100, 20.0), mass=MASS, step=1e-4)
    assert repr(trace).startswith("FrictionTrace(101 points over 0.01 s, the part moved by 0.000")
    figure = trace.plot()
    assert [ax.get_ylabel() for ax in figure.axes] == ["position [µm]", "force [N]"]
