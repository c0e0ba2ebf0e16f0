"""The predictive law: linear without limits, a quadratic program within them, against a second solver."""

import copy
import pickle
from types import SimpleNamespace

import numpy as np
import pytest

from sdpgrind import units
from sdpgrind.codegen import StepProgram
from sdpgrind.weldbead import force

LAW = force.Predictive(move_weight=2.0, drift=0.5)
K = LAW.plant.contact_stiffness
QUIET = LAW.plant.replace(sensor=force.SensorChain(noise_sd=0.0, quantum=0.0))


def sine(hertz=1.0, mean=45.0, size=15.0):
    t = np.arange(0, 6, 0.004)
    wanted = mean + size * np.sin(units.hz(hertz) * t)
    return SimpleNamespace(time=t, normal_force=wanted, fly_height=-wanted / K)


def test_without_limits_it_is_its_linear_law():
    plant = LAW.plant.replace(drive=LAW.plant.drive.replace(play=4.8 / K), contact_stiffness=0.85 * K)
    options = {"duration": 4.0, "plant": plant, "rng": 2}
    program = force.simulate_loop(force.PredictiveController(sine(), LAW), **options)
    linear = force.simulate_loop(force.ForceController(sine(), LAW.loop), **options)
    assert program.command == pytest.approx(linear.command, abs=1e-10)


def test_nothing_is_left_over():
    """The estimated offset takes a surface that is not where it was planned to be."""
    controller = force.PredictiveController(sine(size=0.0), LAW.replace(plant=QUIET))
    record = force.simulate_loop(
        controller, duration=4.0, plant=QUIET, surface=lambda t: np.full_like(t, -0.05)
    )
    assert record.force[0, -1] == pytest.approx(45.0, abs=0.01)


def test_prediction_is_the_model_run():
    rng = np.random.default_rng(0)
    look, model = LAW.prediction, LAW.drifting
    state, changes, held = rng.normal(size=model.order), rng.normal(size=LAW.horizon), 0.7
    inputs = held + np.cumsum(changes)
    x, readings = state, []
    for value in inputs:
        x = model.A @ x + model.B * value
        readings.append(model.C @ x)
    assert look.free @ state + look.held * held + look.moves @ changes == pytest.approx(
        np.array(readings), abs=1e-9
    )


def test_gain_of_the_filter_is_stationary():
    """Riccati by iteration."""
    model, P = LAW.drifting, np.eye(LAW.drifting.order)
    noise = np.zeros_like(P)
    noise[-1, -1] = LAW.drift**2
    for _ in range(3000):
        gain = P @ model.C / (model.C @ P @ model.C + 1)
        P = model.A @ (P - np.outer(gain, model.C @ P)) @ model.A.T + noise
    assert LAW.corrects == pytest.approx(P @ model.C / (model.C @ P @ model.C + 1), abs=1e-8)


def test_program_against_a_second_solver(monkeypatch):
    """First moves of OSQP against Clarabel on the same programs."""
    import cvxpy as cp

    seen = []
    controller = force.PredictiveController(
        sine(), LAW, limits=force.Limits(command_max=0.70, command_rate_max=3.0)
    )
    solve = StepProgram.solve

    def spy(self, room):
        solved = solve(self, room)
        seen.append((self.rows, *(each.copy() for each in self.parts(room))))
        return solved

    monkeypatch.setattr(StepProgram, "solve", spy)
    force.simulate_loop(controller, duration=1.5)
    assert len(seen) > 20
    for rows, linear, low, high, found in seen[:: len(seen) // 6]:
        n = LAW.horizon
        hessian = np.zeros((n + 1, n + 1))
        hessian[:n, :n], hessian[n, n] = LAW.prediction.hessian, 1e3
        v = cp.Variable(n + 1)
        finite_low, finite_high = low > -1e19, high < 1e19
        keep = [rows[finite_low] @ v >= low[finite_low], rows[finite_high] @ v <= high[finite_high]]
        cp.Problem(cp.Minimize(0.5 * cp.quad_form(v, cp.psd_wrap(hessian)) + linear @ v), keep).solve(
            solver="CLARABEL"
        )
        assert found[0] == pytest.approx(v.value[0], abs=2e-3)


def test_a_program_is_asked_for_where_the_law_breaks_its_rows(monkeypatch):
    """The kernel tells by sums, moves and readings foreseen; the twin by the matrix that OSQP has."""
    from sdpgrind.weldbead.force import _constrained

    limits = force.Limits(command_max=0.78, command_rate_max=2.0, contact_force=40.0)
    controller = force.PredictiveController(sine(), LAW, limits=limits)
    ask, seen = _constrained.ask, []

    def spy(core, state, estimate, room, *given):
        asked = ask(core, state, estimate, room, *given)
        _, low, high, moves = controller._program.parts(room)
        reached = controller._program.rows @ moves
        seen.append((asked, (reached < low - 1e-9) | (reached > high + 1e-9)))
        return asked

    monkeypatch.setattr(_constrained, "ask", spy)
    force.simulate_loop(controller, duration=4.0, rng=1)
    asked, broken = map(np.array, zip(*seen, strict=True))
    assert np.array_equal(asked == 1, broken.any(axis=1))
    kinds = np.split(broken, [LAW.horizon, 2 * LAW.horizon, 3 * LAW.horizon], axis=1)
    assert 0.1 < asked.mean() < 0.9 and all(kind.any() for kind in kinds[:3])


def test_limits_hold_and_are_foreseen():
    """With a slow table the program starts to move before the law that is only cut off."""
    limits = force.Limits(command_rate_max=0.9, command_max=0.78)
    program = force.PredictiveController(sine(), LAW.replace(plant=QUIET), limits=limits)
    ours = force.simulate_loop(program, duration=5.0, plant=QUIET)
    cut = force.simulate_loop(
        force.ForceController(sine(), LAW.replace(plant=QUIET).loop, limits=limits), duration=5.0, plant=QUIET
    )
    assert ours.command.max() <= 0.78 + 1e-9
    assert np.abs(np.diff(ours.command[0])).max() <= 0.9 / 60 + 1e-9
    assert ours.error_rms(after=1.0)[0] < cut.error_rms(after=1.0)[0]


def test_contact_is_kept_where_it_can_be():
    """A plan that comes down to 2 N on a surface that is lower than planned: contact is not lost."""
    plan, low = sine(mean=12.0, size=10.0), lambda t: np.where(t > 1.0, -0.03, 0.0)
    limits = force.Limits(contact_force=1.5)
    with_care = force.simulate_loop(
        force.PredictiveController(plan, LAW.replace(plant=QUIET), limits=limits),
        duration=5.0,
        plant=QUIET,
        surface=low,
    )
    assert with_care.reading[0][100:].min() > 0.5


def test_same_bits_again_and_in_copies():
    limits = force.Limits(command_max=0.70, command_rate_max=3.0)
    controller = force.PredictiveController(sine(), LAW, limits=limits)
    first = force.simulate_loop(controller, duration=1.5, rng=3)
    again = force.simulate_loop(controller, duration=1.5, rng=3)
    assert np.array_equal(first.command, again.command)
    for reading in (30.0, 50.0, 20.0):
        controller.step(force=reading)
    twin, sent = copy.deepcopy(controller), pickle.loads(pickle.dumps(controller))
    ahead = [controller.step(force=10.0) for _ in range(5)]
    assert [twin.step(force=10.0) for _ in range(5)] == ahead
    assert [sent.step(force=10.0) for _ in range(5)] == ahead
    assert controller.programs[1] == 0


def test_every_program_takes_whole_rounds_of_iterations_and_no_polishing(monkeypatch):
    """What generated code does; a fixed number of iterations bounds its time."""
    controller = force.PredictiveController(
        sine(), LAW, limits=force.Limits(command_max=0.70, command_rate_max=3.0)
    )
    solve, told, solvers = StepProgram.solve, [], []

    def spy(self, room):
        solvers.extend([] if solvers else [self.solver()])
        linear, low, high, guess = self.parts(room)
        solvers[0].update(q=linear, l=low, u=high)
        solvers[0].warm_start(x=guess, y=np.zeros(low.size))
        told.append(solvers[0].solve(raise_error=False).info)
        return solve(self, room)

    monkeypatch.setattr(StepProgram, "solve", spy)
    force.simulate_loop(controller, duration=1.0)
    assert told and {info.iter for info in told} == {500}
    assert {info.status_polish for info in told} == {0}
    assert max(info.prim_res for info in told) < 1e-6 and controller.programs[1] == 0


def test_messages():
    with pytest.raises(TypeError, match="predictive must be a Predictive"):
        force.PredictiveController(sine(), LAW.loop)
    with pytest.raises(ValueError, match=r"move_weight must be > 0; got 0\.0"):
        force.Predictive(move_weight=0.0)
    with pytest.raises(ValueError, match="horizon must be >= 2; got 1"):
        force.Predictive(horizon=1)
    with pytest.raises(ValueError, match="limits leave no observer law in the range searched"):
        force.DisturbanceObserver.design(limits=force.DesignLimits(runout_response=1e-6))
    with pytest.raises(ValueError, match=r"runout_response must be > 0; got 0\.0"):
        force.DesignLimits(runout_response=0.0)
    with pytest.raises(ValueError, match=r"lead must be in \[0, 1\]; got 2\.0"):
        force.DisturbanceObserver(cutoff=10.0, lead=2.0)
