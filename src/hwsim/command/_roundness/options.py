"""Texts of options to values: lengths with units, columns, sections, bands with limits."""

import re
from pathlib import Path
from typing import Any

_ARC_LENGTH = ".x3p"  # a profile over the length of arc, without angles
_BAND = re.compile(r"(\d+)(?:-(\d+))?=(.+)")
_NUMBER = r"[\d.]+"
_PASSED = re.compile(rf"({_NUMBER})(?:(-)({_NUMBER})?)?")
_IN_UM = ("limit", "noise-sd")  # told in micrometres, so that a number alone would be a guess


def length(option: str, given: str | None) -> float | None:
    """A length in mm; a number alone is in mm, but of what is usually told in micrometres."""
    if given is None:
        return None
    from sdpgrind.base.unit_text import quantity

    try:
        number = float(given)
    except ValueError:
        return quantity(f"--{option}", given, "mm")
    if option in _IN_UM:
        example = "2.5um or 0.0025mm" if option == "limit" else "0.05um"
        raise ValueError(f"--{option} must have its unit, as {example}; got {given!r}")
    return number


def rotation(given: str | None) -> float | None:
    """A turn of the part in rad, which is given with its unit."""
    if given is None:
        return None
    from sdpgrind.base.unit_text import quantity

    try:
        float(given)
    except ValueError:
        return quantity("--rotation", given, "rad")
    raise ValueError(f"--rotation must have its unit, as 0deg or 0.1rad; got {given!r}")


def passed(given: str) -> float | tuple[float, float | None]:
    """A cut-off or a band, upr, from texts as 50, 3-30 and 15-, a high pass."""
    split = _PASSED.fullmatch(given.strip())
    try:
        low, dash, high = split.groups() if split else ("", None, None)
        return float(low) if dash is None else (float(low), None if high is None else float(high))
    except ValueError:
        rule = "a cut-off, upr, or a band of them, as 50, 15-150 or 15-"
        raise ValueError(f"--upr must be {rule}; got {given!r}") from None


def harmonic_limits(given: list[str]) -> dict[int | tuple[int, int], float]:
    """Limits of harmonics and bands, mm, from texts as 42=0.05um and 2-15=0.5um."""
    from sdpgrind.base.unit_text import quantity

    found: dict[int | tuple[int, int], float] = {}
    for text in given:
        split = _BAND.fullmatch(text.strip())
        if split is None or re.fullmatch(r"[\d.eE+-]+", split[3]):
            raise ValueError(
                "--harmonic-limit must be a harmonic or a band, upr, and an amplitude with its unit, as"
                f" 42=0.05um or 2-15=0.5um; got {text!r}"
            )
        key = int(split[1]) if split[2] is None else (int(split[1]), int(split[2]))
        if key in found:
            raise ValueError(f"--harmonic-limit must be given once for {split[0].partition('=')[0]} upr")
        found[key] = quantity("--harmonic-limit", split[3], "mm")
    return found


def column(given: str | None) -> Any:
    """Header of a column, with its unit if one is given behind a colon."""
    if given is None or ":" not in given:
        return given
    name, _, unit = given.rpartition(":")
    return name, unit


def only_angle(path: Path) -> str | None:
    """The column of angles where a table has one, with its unit; None: an even turn."""
    from sdpgrind.base.columns.angles import angle_headings
    from sdpgrind.base.columns.taken import Rules

    if path.suffix.lower() == _ARC_LENGTH:
        return None
    heads = [head for _, head in angle_headings(path, Rules(period=1.0))]
    if len(heads) > 1 or (heads and not heads[0].unit):
        told = ", ".join(repr(head.header) for head in heads)
        raise ValueError(f"--angle must name one column with its unit, as phi:deg; {path.name} has {told}")
    return heads[0].name if heads else None


def section(given: str) -> tuple[str, str]:
    """Header of the sections, and the word of one of them."""
    name, sign, word = given.partition("=")
    if not sign:
        raise ValueError(f"--section must be a column and one of its words, as nr=1; got {given!r}")
    return name, word
