"""Two pages of one job compared: versions, digests of plan and log, every number of the tables."""

from collections.abc import Iterator, Mapping
from typing import Any

from hwsim._report.job import JOB
from sdpgrind.base.sheets import seal
from sdpgrind.base.sheets.origin import versions

PLAN = "plan"
"""Name of the data of a plan in its page."""
_PLACE = tuple[str, int, str, int]  # table, its number, quantity, number of the value


def other_versions(data: Mapping[str, Any]) -> list[str]:
    """Return a sentence for each version, or the processor, that is not the one that made the page."""
    told = data[JOB]["versions"] if JOB in data else data.get(PLAN, {})
    here = versions()
    return [
        f"{name} {told.get(name, 'not known')} made the page, {here[name]} is here"
        for name in here
        if told.get(name) != here[name]
    ]


def differences(before: Mapping[str, Any], after: Mapping[str, Any]) -> list[str]:
    """Return a sentence for each array that differs, and how many numbers of the tables do; empty: none.

    Parameters
    ----------
    before, after : mapping
        Data of both pages by name.
    """
    digests, found = _digests(before), _digests(after)
    different = [f"{name}: differs" for name, digest in digests.items() if found.get(name) != digest]
    numbers, again = dict(_numbers(before)), dict(_numbers(after))
    changed = [place for place in {**numbers, **again} if numbers.get(place) != again.get(place)]
    if changed:
        table, _, name, row = changed[0]
        told = f"{numbers.get(changed[0], 'nothing')} in the page, {again.get(changed[0], 'nothing')} now"
        first = f"the first is {name.replace('_', ' ')} in {table!r}, value {row + 1}: {told}"
        different.append(f"{len(changed)} of {len(numbers)} numbers in tables differ; {first}")
    return different


def compared(data: Mapping[str, Any]) -> list[str]:
    """Return the names of what is compared to the bit."""
    return list(_digests(data))


def _digests(data: Mapping[str, Any]) -> dict[str, str]:
    """SHA-256 of the arrays of plan and log."""
    job = data.get(JOB, {})
    plan = job.get("plan") if job else data.get(PLAN)
    return ({"plan": plan["arrays"]} if plan else {}) | {
        f"log, {name}": digest for name, digest in job.get("log", {}).items()
    }


def _numbers(data: Mapping[str, Any]) -> Iterator[tuple[_PLACE, Any]]:
    """Numbers of all tables of a page, in full, by their places."""
    tables = [block for block in data[seal.PAGE]["blocks"] if "table" in block]
    for number, table in enumerate(tables):
        for amounts in table["amounts"]:
            for row, value in enumerate(amounts["values"]):
                if not isinstance(value, str | None):
                    yield (table["table"], number, amounts["name"], row), value
