"""Vectors of the self-test: rows of inputs with what the library answers, and digests of a long run."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np

from sdpgrind.base.checks import Bools, Floats
from sdpgrind.codegen._files import vector_kernels as kernels
from sdpgrind.codegen._files.shell import reset_state
from sdpgrind.codegen._recipe import Recipe

ROWS = 512  # chosen: rows that are asked of a recipe
BLOCKS, STEPS = 64, 1000  # chosen: digests of the long run, steps of each; half a second on a computer
_FEW_BLOCKS = 2  # chosen: of a step with a quadratic program: some seconds in the library
SEED = 88172645463325252  # source: Marsaglia (2003), Xorshift RNGs

_GREATEST = (-1e308, 1e308)  # chosen: near the greatest doubles


@dataclass(frozen=True)
class Answers:
    """State, outputs and status after each row."""

    states: Floats
    outputs: Floats
    codes: Any


class ReferenceSteps(Protocol):
    """Steps whose bits are the right ones: those of the library, or of C with functions of its own."""

    fresh: Floats
    """State after a reset."""

    def take(self, rows: Floats, resets: Bools) -> Answers:
        """Return what follows on rows, the state going on from the rows before."""


@dataclass
class LibrarySteps:
    """The library's step over rows of inputs."""

    recipe: Recipe

    def __post_init__(self) -> None:
        self.fresh = reset_state(self.recipe)
        self.state = self.fresh.copy()

    def take(self, rows: Floats, resets: Bools) -> Answers:
        """Return what follows on rows (m, inputs), the state going on from the rows before.

        As in C a step works on a copy of the state, which counts where its status is not below 0.
        """
        count, take = len(rows), _taker(self.recipe)
        states, codes = np.empty((count, self.fresh.size)), np.full(count, -1)
        outputs = np.zeros((count, len(self.recipe.outputs)))
        asked = zip(rows.tolist(), resets.tolist(), self.recipe.usable(rows).tolist(), strict=True)
        before = self.state
        for k, ((row, reset, good), state, out) in enumerate(zip(asked, states, outputs, strict=True)):
            state[:] = before = self.fresh if reset else before
            if good:
                code = take(state, row, out)
                if code >= 0:
                    codes[k] = code
                else:
                    state[:], out[:] = before, 0.0
            before = state
        self.state[:] = before
        return Answers(states, outputs, codes)


def _taker(recipe: Recipe) -> Callable[[Floats, list[float], Floats], int]:
    """Return `Recipe.take` for many rows of floats: the types of the constants are looked at once."""
    if recipe.program is not None:
        return recipe.take
    law, after, step = recipe.taken, recipe.after, recipe.entry()
    return lambda state, row, out: int(step(state, *law, *row, *after, out))


@dataclass
class Varied:
    """Endless inputs around the rows of a recipe, the same in C."""

    recipe: Recipe
    rows: Floats
    resets: Bools

    def __post_init__(self) -> None:
        self._seed, self._place = np.array([SEED], dtype=np.uint64), np.array([-1.0, 0.0, 0.0])
        self._missing = ~np.array(self.recipe.finite, dtype=bool)
        self.spread = spread_of(self.recipe)

    def take(self, count: int) -> tuple[Floats, Bools]:
        """Return the next `count` rows, and whether the state is reset before each."""
        out, resets = np.empty((count, self.rows.shape[1])), np.empty(count, dtype=bool)
        kernels.varied(
            self._seed, self._place, self.rows, self.resets, self._missing, self.spread, out, resets
        )
        return out, resets


def spread_of(recipe: Recipe) -> Floats:
    """Return the half-width by which each input is varied, in its unit."""
    return np.array([one.spread for one in recipe.inputs.values()], dtype=float)


def rows_of(recipe: Recipe, rng: np.random.Generator, count: int) -> tuple[Floats, Bools]:
    """Return the rows of all chains of a recipe, and where chains begin."""
    chains = [one for one in recipe.chains(rng, count) if len(one)]
    chains.append(bounds_of(recipe, chains[0]))
    rows = np.ascontiguousarray(np.concatenate(chains))
    resets = np.zeros(len(rows), dtype=bool)
    resets[np.cumsum([0, *map(len, chains[:-1])])] = True
    return rows, resets


def bounds_of(recipe: Recipe, chain: Floats) -> Floats:
    """Return inputs on both sides of each bound of each, infinite, and no numbers, among rows of a chain.

    Rows of the chain stand between: a state that a row outside had changed would show there. The first row is
    outside, where its input has bounds: what it leaves is the state after a reset.
    """
    usual = chain[: max(len(chain) // 2, 1)]
    rows: list[Floats] = []
    for j, (low, high) in enumerate(recipe.limits):
        ends = (low, high, np.nextafter(low, -np.inf), np.nextafter(high, np.inf))
        for value in (*_GREATEST, *ends, -np.inf, np.inf, np.nan):
            row = usual[len(rows) % len(usual)].copy()
            rows += [row, row.copy()]
            rows[-2][j] = value
    return np.array(rows)


@dataclass(frozen=True)
class Vectors:
    """Rows with the right answers, their digest, digests of the long run, and the state after a reset."""

    rows: Floats
    resets: Bools
    answers: Answers
    digest: int
    digests: tuple[int, ...]
    fresh: Floats

    def table(self) -> Floats:
        """Return the rows of ``vectors.bin``: inputs, outputs, status; a row of NaN: reset."""
        found = np.column_stack([self.rows, self.answers.outputs, self.answers.codes.astype(float)])
        return np.insert(found, np.flatnonzero(self.resets), np.nan, axis=0)


def blocks_of(recipe: Recipe) -> int:
    """Return the number of blocks of `STEPS` of the long run."""
    return BLOCKS if recipe.program is None else _FEW_BLOCKS


def vectors_of(recipe: Recipe, reference: Callable[[], ReferenceSteps] | None = None) -> Vectors:
    """Return the vectors of a recipe, the same at every export; `reference` begins anew (the library)."""
    begin = reference or (lambda: LibrarySteps(recipe))
    rows, resets = rows_of(recipe, np.random.default_rng(0), ROWS)
    first = begin()
    answers = first.take(rows, resets)
    varied, steps = Varied(recipe, rows, resets), begin()
    digests = tuple(_digest(steps.take(*varied.take(STEPS))) for _ in range(blocks_of(recipe)))
    return Vectors(rows, resets, answers, _digest(answers), digests, first.fresh)


def _digest(answers: Answers) -> int:
    return int(kernels.digest(answers.states.view(np.uint64), answers.outputs.view(np.uint64), answers.codes))
