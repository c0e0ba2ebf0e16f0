"""The simplest set of values that explains the responses: one alone, a pair, or none."""

from collections.abc import Callable, Sequence
from itertools import combinations
from typing import NamedTuple

import numpy as np

from sdpgrind.base.brief import listed
from sdpgrind.base.doubts.advice import to_plan_with
from sdpgrind.base.doubts.alignment import preferred
from sdpgrind.base.doubts.rows import DIFFERS, Doubt, compared
from sdpgrind.base.doubts.words import amount
from sdpgrind.identify import Estimate, Status

Identified = Callable[[Sequence[str]], Estimate]
_MISFIT = "a model that follows the readings; with this value alone changed it does not"
_RARELY = 0.01  # chosen: probability of a second value for noise alone; less overlooks three of its sds
AS_BELIEVED = (
    "Each value is told with all others as believed, so one wrong value makes several differ: take over one,"
    " not all."
)
_ELSE = (
    "The law does not follow these readings, so they tell none of its values: check units and columns, leave"
    " out approach, touch-in and rows that still follow a change, or take another law."
)


class FieldRow(NamedTuple):
    """Row of a field, and the estimate that it comes from: of the field alone, or of others along with it."""

    row: Doubt
    estimate: Estimate | None = None

    @property
    def fits(self) -> bool:
        """Whether the estimate follows the responses."""
        return self.estimate is not None and self.estimate.ok

    @property
    def unfit(self) -> bool:
        """Whether the field alone cannot explain the responses."""
        return self.estimate is not None and self.estimate.status in (Status.MISFIT, Status.IMPOSSIBLE)

    @property
    def moves(self) -> bool:
        """Whether the responses depend on the field."""
        return self.estimate is not None and not unmoved(self.estimate)


def unmoved(estimate: Estimate) -> bool:
    """Whether the responses do not depend on the values, or on others alike."""
    return bool(np.all(np.isinf(estimate.sd)))


def explaining(
    alone: Sequence[FieldRow], identified: Identified, least: float, readings: int
) -> list[Estimate]:
    """Return the estimates that follow the responses best: of one field, else of pairs; empty: none does.

    Of one field where no second one, fitted along with the best, differs from its believed value by more than
    noise. Best first, and of the others those that the readings do not tell from it, see `preferred`.
    `least`: standard deviation of the rest that is rounding.
    """
    found = _alike([each.estimate for each in alone if each.fits and each.estimate], least, readings)
    if not (_short(found[0], alone, identified, least) if found else any(each.unfit for each in alone)):
        return found
    pairs = combinations([each.row.name for each in alone if each.moves], 2)
    return _alike([estimate for estimate in map(identified, pairs) if estimate.ok], least, readings) or found


def _short(best: Estimate, alone: Sequence[FieldRow], identified: Identified, least: float) -> bool:
    """Whether one more field, fitted along, differs from its believed value by more than noise."""
    if _left(best, least) == least:
        return False
    others = [each.row for each in alone if each.moves and each.row.name not in best.names]
    try:
        along = [(row, identified((*best.names, row.name))) for row in others]
    except ValueError:  # too few readings for one value more
        return False
    chances = [compared(one, row.name, float(row.believed)).chance for row, one in along]
    return any(chance < _RARELY for chance in chances)


def _alike(found: Sequence[Estimate], least: float, readings: int) -> list[Estimate]:
    """Estimates that leave as little as the best, best first."""
    found = sorted(found, key=lambda each: float(f"{_left(each, least):.6g}"))  # equal ones as declared
    squares = [readings * _left(each, least) ** 2 for each in found]
    return [
        each
        for each, square in zip(found, squares, strict=True)
        if not preferred({"best": squares[0], "other": square}, readings).sure
    ]


def _left(each: Estimate, least: float) -> float:
    """Standard deviation of the rest without its correlation, by which estimates are as likely."""
    return max(each.noise_sd * float(np.sqrt(1 - each.noise_correlation**2)), least)


def told_along(each: FieldRow, by: Sequence[Estimate], identified: Identified) -> FieldRow:
    """Row of a field that explains less alone, with those fitted along that explain the responses best."""
    row = each.row
    if not _explains_less(each, by):
        return each
    if not by:
        misfit = each.estimate is not None and each.estimate.status is Status.MISFIT
        return FieldRow(row._replace(note=_MISFIT)) if misfit else each
    holding = [each for each in by if row.name in each.names]
    names = holding[0].names if holding else by[0].names
    try:
        found = holding[0] if holding else identified((*names, row.name))
    except ValueError:  # too few readings for one value more
        return each
    if unmoved(found):
        return FieldRow(row._replace(note=f"in these readings it acts like {listed(names)}"))
    return FieldRow(
        compared(found, row.name, float(row.believed), note=f"{listed(names)} fitted along"), found
    )


def _explains_less(each: FieldRow, by: Sequence[Estimate]) -> bool:
    """Whether a field does not follow the responses alone, or another one follows them better."""
    return each.unfit or (each.fits and not any(each.estimate is one for one in by))


def sentences(alone: Sequence[FieldRow], by: Sequence[Estimate], response: str, unit: str) -> list[str]:
    """Sentences on what the intervals rest on, and on the values that explain the response."""
    if not by:
        return none_of(alone, f"Neither a single value nor a pair explains {response}", unit)
    if len(by[0].names) > 1:
        return [*_pair(alone, by, response, unit), *_advice(by)]
    told = {one.names[0] for one in by}
    rows = [each.row for each in alone if each.row.name in told and each.row.measured]
    along = _along(alone, by)
    words = [AS_BELIEVED] * (len(rows) > bool(along)) + along
    differing = [one for one in by if any(row.name in one.names and row.verdict == DIFFERS for row in rows)]
    if not differing:
        return words
    left = _of_rest(differing[0], unit)
    if len(differing) == 1:
        best = f"Of those that differ, {differing[0].names[0]} alone explains {response} best {left}."
    else:
        best = _not_told_apart(listed([one.names[0] for one in differing]), left)
    return [*words, best, *_advice(differing)]


def _not_told_apart(which: str, left: str) -> str:
    return (
        f"The readings do not tell which of {which} is the wrong one, as each explains them as well"
        f" {left}; the plan with each is told below."
    )


def _of_rest(each: Estimate, unit: str) -> str:
    return f"(sd of the rest {amount(each.noise_sd, unit)})"


def none_of(alone: Sequence[FieldRow], words: str, unit: str) -> list[str]:
    """Sentence that nothing explains the readings; empty: they say too little for that."""
    return [f"{words}: {_nearest(alone, unit)}. {_ELSE}"] if any(each.unfit for each in alone) else []


def _advice(equal: Sequence[Estimate]) -> list[str]:
    """Sentence with the call that plans with one of the estimates."""
    names = [_quoted(each.names) for each in equal]
    if len(names) == 1:
        return to_plan_with([_call(names[0])])
    (told,) = to_plan_with([_call("names")])
    return [f"{told.removesuffix('.')}, names being one of {'; '.join(names)}."]


def _call(names: str) -> str:
    return f"locus.identify(log, {names}, problem=problem)"


def _quoted(names: Sequence[str]) -> str:
    quoted = ", ".join(f'"{name}"' for name in names)
    return quoted if len(names) == 1 else f"({quoted})"


def _along(alone: Sequence[FieldRow], by: Sequence[Estimate]) -> list[str]:
    """Sentence on the fields that explain less alone than one does."""
    names = [each.row.name for each in alone if _explains_less(each, by)]
    if not names:
        return []
    best = by[0].names[0]
    return [f"Alone, {listed(names)} cannot explain the readings as {best} does: told with it fitted along."]


def _pair(alone: Sequence[FieldRow], by: Sequence[Estimate], response: str, unit: str) -> list[str]:
    """Sentences on the pair that explains a response which no field explains alone."""
    names, left = listed(by[0].names), _of_rest(by[0], unit)
    words = [f"No single value explains {response}: {_nearest(alone, unit)}."]
    if len(by) == 1:
        together = f"{names} together do {left}: each value is told with these two fitted along"
        return [*words, f"{together}, the others as believed, and so is its plan."]
    pairs = "; ".join(listed(each.names) for each in by)
    return [
        *words,
        f"Each of these pairs does: {pairs}. A value is told in the first pair that holds it, the others as"
        " believed, so one wrong pair makes several values differ: take over one pair, not all.",
        _not_told_apart("these pairs", left),
    ]


def _nearest(alone: Sequence[FieldRow], unit: str) -> str:
    """What the best of the fields leaves of the response alone."""
    found = [each.estimate for each in alone if (each.fits or each.unfit) and each.estimate is not None]
    best = min(found, key=lambda each: (each.status is Status.IMPOSSIBLE, not each.ok, each.noise_sd))
    left = best.message.removeprefix(f"{Status.MISFIT}: ").partition(":")[0]
    if best.ok:
        left = f"an sd of {amount(best.noise_sd, unit)} is left"
    return f"with {best.names[0]}, the best, {left}"
