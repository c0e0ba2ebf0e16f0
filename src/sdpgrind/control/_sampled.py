"""Sampled linear systems with one input and one output: exact sampling, series, delay, feedback."""

import dataclasses
from functools import cached_property
from typing import Any, Self

import numpy as np
import numpy.typing as npt
import scipy.linalg

from sdpgrind.base import checks
from sdpgrind.base.checks import Complex, Floats


@dataclasses.dataclass(frozen=True, eq=False)
class Sampled:
    """Sampled system x' = A x + B u, y = C x + D u, with one input and one output, in the units of its user.

    Parameters
    ----------
    A : array, (n, n)
        Transition matrix, in the units of the state.
    B : array, (n,)
        Input vector.
    C : array, (n,)
        Output vector.
    D : float
        Feedthrough.
    sample_time : float
        Time between two samples, s.

    Examples
    --------
    >>> accumulator = Sampled([[1.0]], [1.0], [1.0], 0.0, 0.1)
    >>> accumulator.run([1.0, 1.0, 1.0])
    array([0., 1., 2.])
    """

    A: Floats
    B: Floats
    C: Floats
    D: float
    sample_time: float

    def __post_init__(self) -> None:
        order = np.size(self.B)
        for name, shape in (("A", (order, order)), ("B", (order,)), ("C", (order,))):
            array = checks.finite_array(name, getattr(self, name))
            if array.size != np.prod(shape):
                raise checks.refuse(name, f"of shape {shape}", array.shape)
            object.__setattr__(self, name, array.reshape(shape))
        object.__setattr__(self, "D", checks.number("D", self.D))
        object.__setattr__(self, "sample_time", checks.positive("sample_time", self.sample_time, "s"))

    @property
    def order(self) -> int:
        """Number of states, a whole number."""
        return len(self.B)

    @property
    def poles(self) -> Complex:
        """Poles in the z plane, dimensionless; stable where all are inside the unit circle."""
        return np.asarray(np.linalg.eigvals(self.A), dtype=complex)

    @property
    def stable(self) -> bool:
        """Whether every pole has a modulus < 1, dimensionless."""
        return bool(np.all(np.abs(self.poles) < 1)) if self.order else True

    @property
    def dc_gain(self) -> float:
        """Gain of a constant input, in units of the output over the input; infinite for an integrator."""
        matrix = np.eye(self.order) - self.A
        if self.order and np.linalg.cond(matrix) > 1e14:
            return np.inf
        return float(self.D + self.C @ np.linalg.solve(matrix, self.B))

    def response(self, frequency: npt.ArrayLike) -> Complex:
        """Return the complex gain at angular frequencies.

        Parameters
        ----------
        frequency : array
            Angular frequencies, rad/s.
        """
        w = np.asarray(frequency, dtype=float)
        z = np.exp(1j * w.ravel() * self.sample_time)
        T, B, C = self._triangular
        x = np.zeros((self.order, z.size), dtype=complex)
        for i in range(self.order - 1, -1, -1):  # (z - T) x = B from the last row up, all frequencies at once
            x[i] = (B[i] + T[i, i + 1 :] @ x[i + 1 :]) / (z - T[i, i])
        return np.asarray((self.D + C @ x).reshape(w.shape), dtype=complex)

    @cached_property
    def _triangular(self) -> tuple[Complex, Complex, Complex]:
        """Complex Schur form, with the input and the output in its coordinates."""
        if not self.order:
            return np.zeros((0, 0), dtype=complex), np.zeros(0, dtype=complex), np.zeros(0, dtype=complex)
        T, U = scipy.linalg.schur(self.A, output="complex")
        return T, U.conj().T @ self.B, self.C @ U

    def run(self, values: npt.ArrayLike, start: npt.ArrayLike | None = None) -> Floats:
        """Return the output for a sequence of inputs, in the units of the output.

        Parameters
        ----------
        values : array, (samples,)
            The inputs.
        start : array, (n,), optional
            Initial state. Default: 0.
        """
        inputs = checks.finite_array("values", values)
        state = np.zeros(self.order) if start is None else np.array(start, dtype=float)
        out = np.empty_like(inputs)
        for k, value in enumerate(inputs):
            out[k] = self.C @ state + self.D * value
            state = self.A @ state + self.B * value
        return out

    def then(self, after: "Sampled") -> "Sampled":
        """Return the series connection with a system of the same sample time (s).

        Parameters
        ----------
        after : Sampled
            System driven by the output of this one.
        """
        same_sample_time(self, after)
        top = np.hstack([self.A, np.zeros((self.order, after.order))])
        low = np.hstack([np.outer(after.B, self.C), after.A])
        B = np.concatenate([self.B, after.B * self.D])
        C = np.concatenate([after.D * self.C, after.C])
        return Sampled(np.vstack([top, low]), B, C, self.D * after.D, self.sample_time)

    def scaled(self, gain: float) -> Self:
        """Return the system with its output scaled, dimensionless or in units of a conversion.

        Parameters
        ----------
        gain : float
            Factor on the output.
        """
        return dataclasses.replace(self, C=gain * self.C, D=gain * self.D)

    def delayed(self, delay_samples: int) -> "Sampled":
        """Return the system with its input delayed.

        Parameters
        ----------
        delay_samples : int
            Delay >= 0, a whole number of samples.
        """
        if checks.count("delay_samples", delay_samples, at_least=0) == 0:
            return self
        line = Sampled(
            np.eye(delay_samples, k=-1),
            np.eye(delay_samples)[0],
            np.eye(delay_samples)[-1],
            0.0,
            self.sample_time,
        )
        return line.then(self)

    def closed(self) -> "Sampled":
        """Return the system under unit negative feedback: set-point to output, in units of the output."""
        gain = 1.0 / (1.0 + self.D)
        A = self.A - gain * np.outer(self.B, self.C)
        return Sampled(A, gain * self.B, gain * self.C, gain * self.D, self.sample_time)

    def every(self, number: int) -> "Sampled":
        """Return the system at every `number`-th sample, its input held in between.

        Parameters
        ----------
        number : int
            Ratio of the new sample time (s) to that of this system, a whole number.
        """
        checks.count("number", number)
        A, B = np.eye(self.order), np.zeros(self.order)
        for _ in range(number):
            A, B = self.A @ A, self.A @ B + self.B
        return Sampled(A, B, self.C, self.D, self.sample_time * number)


def same_sample_time(first: Any, second: Any) -> None:
    """Refuse two systems of different sample times (s).

    Parameters
    ----------
    first, second : Sampled
        Or other objects with a ``sample_time``.

    Raises
    ------
    ValueError
        When the sample times differ.
    """
    if abs(first.sample_time - second.sample_time) > 1e-9 * first.sample_time:
        raise checks.refuse(
            "sample_time", f"the same in both: {first.sample_time:g}", second.sample_time, "s"
        )


def sampled(numerator: npt.ArrayLike, denominator: npt.ArrayLike, sample_time: float) -> Sampled:
    """Sample a continuous transfer function exactly for a zero-order hold of its input.

    Parameters
    ----------
    numerator, denominator : array
        Polynomials in s (rad/s), highest power first; the numerator's degree is not above the denominator's.
    sample_time : float
        Time between two samples, s.

    Examples
    --------
    >>> lag = sampled([1.0], [0.5, 1.0], sample_time=0.1)
    >>> round(float(lag.A[0, 0]), 6), round(lag.dc_gain, 12)
    (0.818731, 1.0)
    """
    A, B, C, D = continuous(numerator, denominator)
    return held(A, B, C, D, checks.positive("sample_time", sample_time, "s"))


def continuous(numerator: npt.ArrayLike, denominator: npt.ArrayLike) -> tuple[Floats, Floats, Floats, float]:
    """Return a state space of a continuous transfer function, with states of like size.

    Parameters
    ----------
    numerator, denominator : array
        Polynomials in s (rad/s), highest power first; the numerator's degree is not above the denominator's.

    Returns
    -------
    A, B, C, D
        x' = A x + B u, y = C x + D u, in 1/s and the units of the transfer function.

    Examples
    --------
    >>> A, B, C, D = continuous([3.0], [0.5, 1.0])  # 3/(1 + s/2)
    >>> float(A[0, 0]), float(C[0] * B[0]), D
    (-2.0, 6.0, 0.0)
    """
    top = np.atleast_1d(np.asarray(numerator, dtype=float))
    low = np.atleast_1d(np.asarray(denominator, dtype=float))
    order = len(low) - 1
    scale = float(abs(low[-1] / low[0]) ** (1.0 / order)) if order and low[-1] != 0 else 1.0
    powers = scale ** np.arange(order, -1, -1.0)
    top = np.concatenate([np.zeros(order + 1 - len(top)), top]) * powers
    low = low * powers
    top, low = top / low[0], low / low[0]
    A = np.vstack([-low[1:], np.eye(order)[:-1]]) if order else np.zeros((0, 0))
    return (
        scale * A,
        scale * np.eye(order)[0] if order else np.zeros(0),
        top[1:] - top[0] * low[1:],
        float(top[0]),
    )


def held(A: Floats, B: Floats, C: Floats, D: float, sample_time: float) -> Sampled:
    """Sample a continuous state space exactly for a zero-order hold of its input.

    Parameters
    ----------
    A, B, C, D : array
        x' = A x + B u, y = C x + D u, as `continuous` gives them (1/s).
    sample_time : float
        Time between two samples, s.

    Examples
    --------
    >>> lag = held(*continuous([1.0], [0.5, 1.0]), sample_time=0.1)
    >>> round(float(lag.A[0, 0]), 6)
    0.818731
    """
    order = len(B)
    block = np.zeros((order + 1, order + 1))
    block[:order, :order], block[:order, order] = A * sample_time, B * sample_time
    whole = scipy.linalg.expm(block)
    return Sampled(whole[:order, :order], whole[:order, order], C, D, sample_time)


def ramped(A: Floats, B: Floats, step: float) -> tuple[Floats, Floats, Floats]:
    """Return the exact step of a continuous state space for an input that is linear in each step.

    Parameters
    ----------
    A, B : array
        x' = A x + B u, as `continuous` gives them (1/s).
    step : float
        Length of a step, s.

    Returns
    -------
    transition, old, new
        Weights of the state, of the input before and of the input after, in the units of the state.

    Examples
    --------
    >>> A, B, _, _ = continuous([1.0], [1.0, 0.0])  # an integrator
    >>> [each.ravel().tolist() for each in ramped(A, B, 0.1)]
    [[1.0], [0.05], [0.05]]
    """
    order = len(B)
    block = np.zeros((order + 2, order + 2))
    block[:order, :order], block[:order, order], block[order, order + 1] = A * step, B * step, 1.0
    whole = scipy.linalg.expm(block)
    new = whole[:order, order + 1]
    return whole[:order, :order], whole[:order, order] - new, new
