"""Model predictive control of the force: its linear law without limits, and its matrices."""

from functools import cache, cached_property
from typing import NamedTuple

import numpy as np
import scipy.linalg

from sdpgrind.base.checks import Floats
from sdpgrind.base.quantities import Described, count, described, part, quantity
from sdpgrind.control import Law, Sampled
from sdpgrind.weldbead.force._designs import DesignLimits, best_parameters
from sdpgrind.weldbead.force._feedback import ForceLoop, ForcePlant


class HorizonPrediction(NamedTuple):
    """Readings of the next samples: free @ state + held * last correction + moves @ changes; best: -gain."""

    free: Floats
    held: Floats
    moves: Floats
    hessian: Floats
    gain: Floats


@described("force.predictive")
class Predictive(Described):
    """Predictive law: least sum of (F - F_ref)^2 + move_weight (K_x change of command)^2 over the horizon.

    A Kalman filter estimates the state of the loop and a drifting offset of the platform (mm), so that no
    error remains. Without limits the law is linear; `PredictiveController` adds limits by OSQP.

    Parameters
    ----------
    move_weight : float
        Weight of a change of command against a force error, unit 1.
    drift : float
        Drift of the offset against sensor noise, K_x sd(change in a sample)/sd(reading), unit 1.
    horizon : int
        Samples of the horizon, a whole number.
    plant : ForcePlant
        Plant (mm to N).

    Raises
    ------
    ValueError
        When a value is not positive.

    Examples
    --------
    >>> Predictive(move_weight=1.0, drift=0.2).loop.name
    'predictive'
    """

    move_weight: float = quantity("1", above=0, default=10.0)
    drift: float = quantity("1", above=0, default=0.1)
    horizon: int = count(2, default=20)
    plant: ForcePlant = part(ForcePlant, default_factory=ForcePlant)

    @classmethod
    def design(
        cls, plant: ForcePlant | None = None, limits: DesignLimits | None = None, horizon: int = 20
    ) -> "Predictive":
        """Return the law of largest bandwidth within `limits` on a `plant` (mm to N) for a `horizon`."""
        one = cls(horizon=horizon, plant=ForcePlant() if plant is None else plant)

        @cache
        def predicted(move_weight: float) -> HorizonPrediction:
            return one.replace(move_weight=move_weight).prediction

        @cache
        def correcting(drift: float) -> Floats:
            return one.replace(drift=drift).corrects

        def law(move_weight: float, drift: float) -> Law:
            return one._law(predicted(float(move_weight)), correcting(float(drift)))

        weight, drift = best_parameters(law, ((1e-3, 1e3), (3e-3, 3.0)), one.plant, limits, "predictive")
        return one.replace(move_weight=weight, drift=drift)

    @cached_property
    def scaled(self) -> Sampled:
        """Model from K_x times the correction (N) to the reading (N), with the delay."""
        return self.plant.sampled.scaled(1 / self.plant.contact_stiffness)

    @cached_property
    def drifting(self) -> Sampled:
        """Model with the offset (N) as one more state."""
        model = self.scaled
        A = np.block([[model.A, model.B[:, None]], [np.zeros((1, model.order)), np.ones((1, 1))]])
        return Sampled(A, np.append(model.B, 0.0), np.append(model.C, 0.0), 0.0, model.sample_time)

    @cached_property
    def corrects(self) -> Floats:
        """Change of the estimated state, N, per newton of innovation."""
        model = self.drifting
        noise = np.zeros((model.order, model.order))
        noise[-1, -1] = self.drift**2
        column = model.C[:, None]
        P = scipy.linalg.solve_discrete_are(model.A.T, column, noise, np.ones((1, 1)))
        return np.asarray(P @ model.C / (model.C @ P @ model.C + 1.0))

    @cached_property
    def prediction(self) -> HorizonPrediction:
        """Matrices of the horizon, in N."""
        model, n = self.drifting, self.horizon
        rows, row = [], model.C
        for _ in range(n):
            row = row @ model.A
            rows.append(row)
        impulse = np.array([model.C @ np.linalg.matrix_power(model.A, i) @ model.B for i in range(n)])
        steps = np.cumsum(impulse)
        moves = scipy.linalg.toeplitz(steps, np.zeros(n))
        hessian = moves.T @ moves + self.move_weight * np.eye(n)
        gain = np.linalg.solve(hessian, moves.T)
        return HorizonPrediction(np.array(rows), steps, moves, hessian, gain)

    @property
    def law(self) -> Law:
        """Law without limits, mm per N."""
        return self._law(self.prediction, self.corrects)

    def _law(self, look: HorizonPrediction, M: Floats) -> Law:
        """Law of a prediction and of the changes per newton of innovation."""
        model = self.drifting
        feed, held = look.gain[0] @ look.free, look.gain[0] @ look.held
        filtered = np.eye(model.order) - np.outer(M, model.C)
        row = np.append(-feed @ filtered, 1.0 - held)
        direct = float(feed @ M)
        A = np.zeros((model.order + 1, model.order + 1))
        A[:-1, :-1] = model.A @ filtered
        inputs = np.append(model.B, 1.0)
        B = np.append(-model.A @ M, 0.0)
        system = Sampled(A + np.outer(inputs, row), B + inputs * direct, row, direct, model.sample_time)
        return Law(system.scaled(1 / self.plant.contact_stiffness), inputs * self.plant.contact_stiffness)

    @cached_property
    def loop(self) -> ForceLoop:
        """Loop closed by the law without limits (mm, N, s)."""
        return ForceLoop(self.law, self.plant, "predictive")
