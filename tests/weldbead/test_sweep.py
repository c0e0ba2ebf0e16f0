"""Many plans in parallel, and sensitivities of the expected penalty."""

from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest

from sdpgrind import sdp, weldbead

P1 = weldbead.preset("P1").replace(durations=(6, 12), horizon=24.0, height_max=1.0)
STATE = {"height": 1.0, "time_left": 24.0}


def test_sweep_is_the_plans():
    cases = {
        law: P1.replace(scatter=weldbead.Scatter("C1", 0.15, law=law))
        for law in ("rayleigh", "lognormal", "normal")
    }
    height, time = np.array([[0.5], [1.0]]), np.array([12.0, 24.0])
    found = weldbead.sequence.sweep(cases, height=height, time_left=time, tolerance=1e-2)
    assert list(found) == list(cases)
    for law, problem in cases.items():
        np.testing.assert_array_equal(found[law], weldbead.plan(problem, tolerance=1e-2).value(height, time))


def test_sweep_does_not_depend_on_the_executor():
    cases = {str(r): P1.replace(scatter=weldbead.Scatter("C1", r), horizon=12.0) for r in (0.05, 0.1, 0.2)}
    alone = weldbead.sequence.sweep(cases, height=1.0, time_left=12.0, tolerance=1e-2)
    with ThreadPoolExecutor(2) as executor:
        assert (
            weldbead.sequence.sweep(cases, height=1.0, time_left=12.0, tolerance=1e-2, executor=executor)
            == alone
        )
    assert list(alone.values()) == sorted(alone.values())


@pytest.fixture(scope="module")
def found():
    return weldbead.sequence.sensitivity(P1, **STATE, tolerance=1e-4)


def test_elasticities_against_finite_differences(found):
    # Other steps, one grid, one side after the other.
    def value(**changes):
        problem = P1.replace(**changes)
        return weldbead.plan(problem, tolerance=None, nodes=201).value(**STATE)

    base = value()
    assert found.value == pytest.approx(base, abs=1e-4)
    for name in ("specific_energy", "idle_power"):
        size = getattr(P1.model, name)
        sides = [(value(**{name: size * (1 + step)}) - base) / step for step in (-0.01, 0.01)]
        assert found[name] == pytest.approx(np.mean(sides), rel=0.05, abs=2e-3)
    sides = [
        (value(scatter=weldbead.Scatter("C1", 0.15 * (1 + step))) - base) / step for step in (-0.01, 0.01)
    ]
    assert found["relative_sd"] == pytest.approx(np.mean(sides), rel=0.05, abs=2e-3)


def test_signs(found):
    assert found["specific_energy"] > 0 and found["idle_power"] > 0  # harder to grind
    assert found["friction_ratio"] < 0 and found["force_max"] < 0  # more power
    assert found["relative_sd"] > 0
    assert found["under"] > 0 and found["over"] > 0


def test_identities(found):
    # Power holds mu, R and omega0 as a product; as the force is chosen, only their product with its limit
    # counts.
    for name in ("disk_radius", "free_speed", "force_max"):
        assert found[name] == pytest.approx(found["friction_ratio"], rel=2e-3, abs=1e-4)
    # J is linear in the charges together (Euler), up to the second order of the step.
    assert found["under"] + found["over"] == pytest.approx(found.value, rel=5e-3)
    # All powers together leave the cut as it is: K1, K2 and mu by the same factor.
    total = found["specific_energy"] + found["idle_power"] + found["friction_ratio"]
    assert total == pytest.approx(0.0, abs=0.02 * abs(found["friction_ratio"]) + 1e-3)
    # J(a x; K1/a) = a J(x; K1) for linear charges: the derivative with respect to a at 1.
    slope = weldbead.plan(P1, tolerance=None, nodes=201).gradient(**STATE)
    assert found["specific_energy"] == pytest.approx(
        STATE["height"] * slope - found.value, rel=0.05, abs=2e-3
    )


def test_chosen_names_and_pairs():
    problem = P1.replace(scatter=weldbead.Scatter(("C1", "K2"), (0.1, 0.1)), horizon=12.0)
    found = weldbead.sequence.sensitivity(
        problem, height=0.5, time_left=12.0, names=["over", "relative_sd"], step=0.05, tolerance=1e-2
    )
    assert found.names == ("over", "relative_sd")
    assert found["over"] > 0 and found["relative_sd"] > 0
    quadratic = weldbead.preset("P5").replace(durations=(6, 12), horizon=12.0, late_window=20.0)
    found = weldbead.sequence.sensitivity(
        quadratic, height=0.3, time_left=2.0, names=["under", "over"], tolerance=1e-2
    )
    assert found["under"] > 0 and found["over"] > 0
    assert found["under"] + found["over"] < 0.9 * found.value  # the rest is lateness


def test_picture(found):
    plt = pytest.importorskip("matplotlib.pyplot")
    figure = found.plot()
    assert len(figure.axes[0].patches) == len(found.names)
    plt.close(figure)


def test_messages():
    with pytest.raises(ValueError, match=r"names must be one of specific_energy, .*; got 'wheel'"):
        weldbead.sequence.sensitivity(P1, **STATE, names=["wheel"])
    with pytest.raises(
        ValueError, match=r"names must be a sequence of one or more of specific_energy, .*; got \[\]"
    ):
        weldbead.sequence.sensitivity(P1, **STATE, names=[])
    with pytest.raises(ValueError, match=r"step must be > 0 \(1\); got 0.0"):
        weldbead.sequence.sensitivity(P1, **STATE, step=0.0)
    curved = P1.replace(height_charge=sdp.Charge(under=lambda z: 2 * z**1.5, over=sdp.Linear(10.0)))
    with pytest.raises(ValueError, match="names must not hold 'under' where that side is a function"):
        weldbead.sequence.sensitivity(curved, **STATE, names=["under"])
