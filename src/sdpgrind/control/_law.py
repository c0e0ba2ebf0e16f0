"""Sampled feedback law with anti-windup: the applied command is fed back into its state."""

import dataclasses

import numpy as np

from sdpgrind.base import checks
from sdpgrind.base.checks import Floats
from sdpgrind.control._kernels import LawCore, law_output, law_update
from sdpgrind.control._sampled import Sampled, same_sample_time


@dataclasses.dataclass(frozen=True, eq=False)
class Law:
    """Feedback law u = C x + D e, x' = A x + B e + L (applied u - u), in the units of its user.

    The last term makes the state consistent with the applied command: no windup, and no bump on return from a
    limit.

    Parameters
    ----------
    system : Sampled
        The linear law from error to command.
    L : array, (n,)
        Anti-windup gain: change of the state per unit of command that was cut off.

    Examples
    --------
    >>> integrator = Sampled([[1.0]], [1.0], [0.5], 0.75, 0.1)
    >>> law = Law(integrator, [1 / 0.5])  # back-calculation
    >>> law.simulate([10.0, 10.0, -10.0], high=1.0).tolist()  # no windup: the command reverses at once
    [1.0, 1.0, -9.0]
    """

    system: Sampled
    L: Floats

    def __post_init__(self) -> None:
        array = checks.finite_array("L", self.L)
        if array.shape != self.system.B.shape:
            raise checks.refuse("L", f"of shape {self.system.B.shape}", array.shape)
        object.__setattr__(self, "L", array)

    @classmethod
    def internal_model(cls, model: Sampled, filter: Sampled) -> "Law":
        """Return the internal-model law C = Q/(1 - P Q), in units of command over error.

        The applied command drives the internal model: limits cause no windup.

        Parameters
        ----------
        model : Sampled
            Stable, strictly proper plant P with its delays.
        filter : Sampled
            Stable filter Q.
        """
        same_sample_time(model, filter)
        if model.D != 0:
            raise checks.refuse("model.D", "0 (a plant that answers after its command)", model.D)
        P, Q = model, filter
        top = np.hstack([P.A + Q.D * np.outer(P.B, P.C), np.outer(P.B, Q.C)])
        low = np.hstack([np.outer(Q.B, P.C), Q.A])
        B = np.concatenate([Q.D * P.B, Q.B])
        C = np.concatenate([Q.D * P.C, Q.C])
        law = Sampled(np.vstack([top, low]), B, C, Q.D, P.sample_time)
        return cls(law, np.concatenate([P.B, np.zeros(Q.order)]))

    @property
    def core(self) -> LawCore:
        """Plain arrays for compiled code, in the units of the law."""
        s = self.system
        A, B, C, L = (np.ascontiguousarray(each) for each in (s.A, s.B, s.C, self.L))
        return LawCore(A, B, C, float(s.D), L)

    def simulate(self, errors: Floats, low: float = -np.inf, high: float = np.inf) -> Floats:
        """Return the commands applied for a sequence of errors, in units of the command.

        Parameters
        ----------
        errors : array, (samples,)
            Errors, in units of the error.
        low, high : float
            Limits of the command, in units of the command.
        """
        values = checks.finite_array("errors", errors)
        core, state, work = self.core, np.zeros(self.system.order), np.zeros(self.system.order)
        out = np.empty_like(values)
        for k, error in enumerate(values):
            asked = law_output(core, state, error)
            out[k] = min(max(asked, low), high)
            law_update(core, state, error, out[k] - asked, work)
        return out
