"""Messages of the library in the terms of the command: ``--radius`` instead of the argument ``radius``."""

import re
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

_OPTIONS = {
    "angle": "--angle",
    "deviation": "--deviation",
    "reading": "--reading",
    "section": "--section",
    "radius": "--radius",
    "centred": "--centred",
    "tip_radius": "--tip-radius",
    "internal": "--internal",
    "noise_sd": "--noise-sd",
    "upr": "--upr",
    "kind": "--circle",
    "limits": "--harmonic-limit",
    "upr_max": "--harmonic-limit",
    "instrument": "--instrument",
    "height": "--height",
    "before": "--before",
    "rotation": "--rotation",
}
_NAME = "|".join(_OPTIONS)
_PHRASES = (
    ("either reading or deviation", "either --reading or --deviation"),
    ("as the call says", "as the option says"),
    ("data must be an existing file", "the file must exist"),
    ("data must", "the file must"),
    ("; got None", "; it is not given"),
    ("profile.remove_asperities() takes", "--remove-asperities takes"),
    (r": give them to Profile.from_deviation(..., radius=)", ": give --deviation and --radius"),
    (": give Profile.from_deviation its radius", ": give --radius"),
    ("or give it, Profile.with_noise_sd", "or give --noise-sd"),
    ("or give noise_sd (mm) to reference_circle", "or give --noise-sd"),
    ("or give noise_sd (mm) of the instrument", "or give --noise-sd"),
    (": units.um(...) for micrometres?", ": um for micrometres?"),
    (": give upr_max=", ": none is told of "),
    (", or of a band (low, high)", ", or of a band, as 2-15=0.5um"),
    (" for remove_asperities;", " for --remove-asperities;"),
    ("remove_asperities", "--remove-asperities"),
)
"""Calls of the library, and the options in their place."""
_OTHER_UNIT = re.compile(
    r"\b(radius|tip_radius)=[\d.e+-]+ \((\w+)\)"
)  # what a number would be in another unit
_GOT = re.compile(r"; got ([\d.e+-]+) mm")
_NO_OPTION = re.compile(r" \(plausible=False [^)]*\)")  # the command takes nothing that is not plausible
_READINGS = re.compile(r"\breading must (?=have|close|leave)")  # those read, not the option
_COLUMN = re.compile(rf'\b({_NAME})=\("([^"]+)", "([^"]+)"\)')
_SECTION = re.compile(r'\bsection=\("([^"]+)", ([^)]+)\)')
_SWITCH = re.compile(rf"\b({_NAME})=True\b")
_SECTIONS = re.compile(r'say section=\("([^"]+)", \.\.\.\) or Sections\.read')
_LIST = "say --section {0}=WORD for one of them, or read all in Python, Sections.read"
_QUOTED = re.compile(r"""(?<!\w)('[^']*'|"[^"]*")(?!\w)""")  # words of a file, but no apostrophes
_VALUE = re.compile(rf"(?<![-\w])({_NAME})=(?=\S)")
_BARE = re.compile(rf"(?<![-\w])({_NAME})=(?=\s|$)")
_SUBJECT = re.compile(
    rf"(?:(?<=^)|(?<=: )|(?<=or )|(?<=and ))({_NAME})(?=(?:\[[^\]]*\])?,? (?:must|needs|and)\b)"
)


def in_terms(message: str) -> str:
    """The message with options in place of arguments; names of columns and quoted words stay as they are."""
    kept: list[str] = []

    def keep(words: str) -> str:
        kept.append(words)
        return f"\0{len(kept) - 1}\0"

    if (given := _GOT.search(message)) is not None:
        message = _OTHER_UNIT.sub(lambda found: keep(f"{_OPTIONS[found[1]]} {given[1]}{found[2]}"), message)
    message = _SECTIONS.sub(lambda found: keep(_LIST.format(found[1])), _NO_OPTION.sub("", message))
    message = _SECTION.sub(lambda found: keep(f"--section {found[1]}={found[2]}"), message)
    message = _COLUMN.sub(lambda found: keep(f"{_OPTIONS[found[1]]} {found[2]}:{found[3]}"), message)
    message = _options(_QUOTED.sub(lambda found: keep(found[0]), message))
    for place in reversed(range(len(kept))):  # quoted words may hold an option that was kept before them
        message = message.replace(f"\0{place}\0", kept[place])
    return message


def _options(message: str) -> str:
    """The message with options in place of calls and arguments."""
    for call, option in _PHRASES:
        if option not in message:
            message = message.replace(call, option)
    message = _READINGS.sub("the readings must ", message)
    message = _SWITCH.sub(lambda found: _OPTIONS[found[1]], message)
    message = _VALUE.sub(lambda found: f"{_OPTIONS[found[1]]} ", message)
    message = _BARE.sub(lambda found: _OPTIONS[found[1]], message)
    return _SUBJECT.sub(lambda found: _OPTIONS[found[1]], message)


@contextmanager
def spoken() -> Iterator[None]:
    """Errors and warnings of the library within are told in the terms of the command."""
    with warnings.catch_warnings():
        show = warnings.showwarning

        def told(message: Warning | str, *where: Any, **more: Any) -> None:
            show(in_terms(str(message)), *where, **more)

        warnings.showwarning = told
        try:
            yield
        except (ValueError, FileNotFoundError) as error:
            if getattr(error, "filename", None) or (said := in_terms(str(error))) == str(error):
                raise
            raise ValueError(said) from error
