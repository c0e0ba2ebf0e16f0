"""The simplest set of values that explains the responses: one alone, a pair, or none."""

from collections.abc import Callable, Sequence
from itertools import combinations
from typing import NamedTuple

from sdpgrind.base.brief import listed
from sdpgrind.base.doubts.advice import to_plan_with
from sdpgrind.base.doubts.rows import DIFFERS, Doubt, compared
from sdpgrind.base.doubts.words import amount
from sdpgrind.identify import Estimate, Status

Identified = Callable[[Sequence[str]], Estimate]
_MISFIT = "a model that follows the readings; with this value alone changed it does not"
AS_BELIEVED = (
    "Each value is told with all others as believed, so one wrong value makes several differ: take over one,"
    " not all."
)
_ELSE = (
    "The law does not follow these readings, so they tell none of its values: check units and columns, leave"
    " out approach and touch-in, or take another law."
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
        return self.estimate is not None and self.estimate.status is not Status.UNDETERMINED


def explaining(alone: Sequence[FieldRow], identified: Identified, least: float) -> list[Estimate]:
    """Return estimates that follow the responses, best first: of one field, else of pairs; empty: none does.

    `least`: standard deviation of the rest that is rounding.
    """
    found = [each.estimate for each in alone if each.fits and each.estimate is not None]
    if not found and any(each.unfit for each in alone):
        pairs = combinations([each.row.name for each in alone if each.moves], 2)
        found = [estimate for estimate in map(identified, pairs) if estimate.ok]
    return sorted(found, key=lambda each: float(f"{max(each.noise_sd, least):.6g}"))  # equal ones as declared


def told_along(each: FieldRow, by: Sequence[Estimate], identified: Identified) -> FieldRow:
    """Row of a field that does not fit alone, with those fitted along that explain the responses best."""
    row = each.row
    if not each.unfit:
        return each
    if not by:
        misfit = each.estimate is not None and each.estimate.status is Status.MISFIT
        return FieldRow(row._replace(note=_MISFIT)) if misfit else each
    holding = [each for each in by if row.name in each.names]
    names = holding[0].names if holding else by[0].names
    found = holding[0] if holding else identified((*names, row.name))
    if found.status is Status.UNDETERMINED:
        return FieldRow(row._replace(note=f"in these readings it acts like {listed(names)}"))
    return FieldRow(
        compared(found, row.name, float(row.believed), note=f"{listed(names)} fitted along"), found
    )


def sentences(alone: Sequence[FieldRow], by: Sequence[Estimate], response: str, unit: str) -> list[str]:
    """Sentences on what the intervals rest on, and on the values that explain the response."""
    if not by:
        return none_of(alone, f"Neither a single value nor a pair explains {response}")
    if len(by[0].names) > 1:
        return [*_pair(alone, by, response, unit), *to_plan_with([_call(by[0].names)])]
    told = {each.row.name: each.row.verdict for each in alone if each.fits and each.row.measured}
    along = _along(alone, by)
    words = [AS_BELIEVED] * (len(told) > bool(along)) + along
    best = next((each for each in by if told.get(each.names[0]) == DIFFERS), None)
    if best is None:
        return words
    left = amount(best.noise_sd, unit)
    explains = f"{best.names[0]} alone explains {response} best (sd of the rest {left})"
    return [*words, f"Of those that differ, {explains}.", *to_plan_with([_call(best.names)])]


def none_of(alone: Sequence[FieldRow], words: str) -> list[str]:
    """Sentence that nothing explains the readings; empty: they say too little for that."""
    return [f"{words}: {_nearest(alone)}. {_ELSE}"] if any(each.unfit for each in alone) else []


def _call(names: Sequence[str]) -> str:
    quoted = ", ".join(f'"{name}"' for name in names)
    return f"locus.identify(log, {quoted if len(names) == 1 else f'({quoted})'}, problem=problem)"


def _along(alone: Sequence[FieldRow], by: Sequence[Estimate]) -> list[str]:
    """Sentence on the fields that do not fit alone, where one does."""
    names = [each.row.name for each in alone if each.unfit]
    if not names:
        return []
    return [f"Alone, {listed(names)} cannot explain the readings: told with {by[0].names[0]} fitted along."]


def _pair(alone: Sequence[FieldRow], by: Sequence[Estimate], response: str, unit: str) -> list[str]:
    """Sentences on the pair that explains a response which no field explains alone."""
    names, left = listed(by[0].names), amount(by[0].noise_sd, unit)
    words = [f"No single value explains {response}: {_nearest(alone)}."]
    if len(by) == 1:
        together = (
            f"{names} together do (sd of the rest {left}): each value is told with these two fitted along"
        )
        return [*words, f"{together}, the others as believed, and so is its plan."]
    pairs = "; ".join(listed(each.names) for each in by)
    return [
        *words,
        f"Each of these pairs does: {pairs}. A value is told in the best pair that holds it, the others as"
        " believed, so one wrong pair makes several values differ: take over one pair, not all.",
        f"Of these pairs {names} explain it best (sd of the rest {left}).",
    ]


def _nearest(alone: Sequence[FieldRow]) -> str:
    """What the best of the fields that do not fit alone leaves of the first response."""
    found = [each.estimate for each in alone if each.unfit and each.estimate is not None]
    best = min(found, key=lambda estimate: (estimate.status is not Status.MISFIT, estimate.noise_sd))
    left = best.message.removeprefix(f"{Status.MISFIT}: ").partition(":")[0]
    return f"with {best.names[0]}, the best, {left}"
