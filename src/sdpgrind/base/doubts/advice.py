"""The calls that put what the data tell into a problem."""

from collections.abc import Iterable


def to_plan_with(calls: Iterable[str]) -> list[str]:
    """Return the sentence with the calls of ``identify`` to pass to ``updated``; empty: nothing is told."""
    told = "".join(f".updated({call})" for call in calls)
    return [f"To plan with what the data tell (log: what was given here): problem{told}."] if told else []
