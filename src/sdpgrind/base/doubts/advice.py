"""The calls that put what the data tell into a problem."""

from collections.abc import Iterable, Sequence

_GIVEN = "(log: what was given here)"


def to_plan_with(calls: Iterable[str]) -> list[str]:
    """Return the sentence with the calls of ``identify`` to pass to ``updated``; empty: nothing is told."""
    told = "".join(f".updated({call})" for call in calls)
    return [f"To plan with what the data tell {_GIVEN}: problem{told}."] if told else []


def to_plan_with_one_of(calls: Sequence[str]) -> list[str]:
    """Return the sentence with the calls of which only one is to be taken; of a single one `to_plan_with`."""
    if len(calls) < 2:
        return to_plan_with(calls)
    each = ", or ".join(f"problem.updated({call})" for call in calls)
    return [f"To plan with one of them {_GIVEN}: {each}."]
