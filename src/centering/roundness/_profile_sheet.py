"""Page of a profile: four reference circles, limits kept or not, largest undulations."""

import os
from collections.abc import Mapping
from difflib import get_close_matches
from typing import Any

import numpy as np

from centering.roundness._harmonic_verdicts import harmonic_verdicts, measured_for, split_limits
from centering.roundness._harmonics import above_noise
from centering.roundness._origin import remarks_on
from centering.roundness._ront_verdict import without_interval
from centering.roundness._roundness import Roundness
from centering.roundness._roundness_interval import RoundnessInterval, limit_in_mm
from sdpgrind.base import checks
from sdpgrind.base.by_name import called
from sdpgrind.base.sheets.amounts import Amounts
from sdpgrind.base.sheets.blocks import AmountTable, Block, Heading, Listing, Picture, Sentences
from sdpgrind.base.units import UM

_CIRCLES = ("LSC", "MZC", "MCC", "MIC")
FORM = {"RONt": "value", "RONp": "ron_p", "RONv": "ron_v", "RONq": "ron_q"}  # source: ISO 12181-1
_NAMES = {f"{name} ({kind})": (name, kind) for kind in _CIRCLES for name in FORM}
_NAMES |= {name: (name, "LSC") for name in FORM}  # source: ISO 12181-2, LSC unless a drawing says another
_LARGEST = 8  # undulations in a table; chosen: the others are below them


def report(profile: Any, path: str | os.PathLike[str] | None, limits: Mapping[Any, float] | None) -> str:
    """Write the page of a profile, or return its text; limits of parameters by name, of harmonics by upr."""
    named, waves = split_limits(limits)
    given = {name: limit_of(name, each, _NAMES) for name, each in named.items()}
    form = profile.roundness("LSC")
    more: list[Block] = [_circles(profile), *_undulations(profile), Picture("LSC", form.plot)]
    verdicts = [_verdict(profile, name, limit) for name, limit in given.items()]
    verdicts += harmonic_verdicts(measured_for(profile, waves))
    remarks = remarks_on(form.origin)
    more.insert(0, Sentences([*verdicts, _passed(profile), *remarks], strong=bool(limits)))
    if (source := profile.source) is not None:
        more += [Heading("Source of the data"), Listing(str(source))]
    return str(called("sdpgrind.base.sheets.record_page:report", profile, path, tuple(more)))


def _passed(profile: Any) -> str:
    """Sentence on the undulations that count."""
    if told := profile._origin.filter:
        return f"filtered: {told}"
    return "not filtered: all undulations; profile.filter(upr=50).report(...) where a drawing says 1 to 50"


def limit_of(name: str, given: float, names: Mapping[str, Any]) -> float:
    """Limit in mm; an unknown name, and one in micrometres, is refused."""
    if name not in names:
        lower = {each.lower(): each for each in names}
        close = get_close_matches(name.lower(), lower, 1)
        meant = f"; is {lower[close[0]]!r} meant?" if close else ""
        known = ", ".join(names)
        raise ValueError(f"{checks.refuse('limits', f'one of {known}', name)}{meant}")
    return limit_in_mm(f"limits[{name!r}]", given)


def _verdict(profile: Any, asked: str, limit: float) -> str:
    """Sentence on a limit; RONt has an interval, so it may be undecided."""
    name, kind = _NAMES[asked]
    try:
        form: Roundness = profile.roundness(kind)
    except ValueError as error:
        raise ValueError(f"limits[{asked!r}]: {error}") from None
    if name == "RONt":
        return form.verdict(limit)
    value = getattr(form, FORM[name])
    size = f"{name} ({kind}) {UM * value:.4g} µm, limit {UM * limit:.4g} µm"
    return f"{size}: {without_interval(value, limit)}"


def _ends(form: Roundness) -> RoundnessInterval | None:
    """Interval of RONt; None where the noise is not known, or no method is."""
    return None if form.why_no_interval else form.interval()


def _circles(profile: Any) -> AmountTable:
    columns: dict[str, list[Any]] = {name: [] for name in ("circle", "RONt", "from", "to", *FORM)}
    for kind in _CIRCLES:
        try:
            found = profile.roundness(kind)
        except ValueError:  # no such circle about this profile
            continue
        ends = _ends(found)
        columns["circle"].append(kind)
        for name, field in FORM.items():
            columns[name].append(getattr(found, field))
        for name, end in (("from", "low"), ("to", "high")):
            columns[name].append(np.nan if ends is None else getattr(ends, end))
    if np.all(np.isnan(columns["from"])):
        del columns["from"], columns["to"]
    amounts = [Amounts.of(name, values, "mm" if name != "circle" else "") for name, values in columns.items()]
    return AmountTable("Roundness about each reference circle (from, to: 95 % interval of RONt)", amounts)


def _undulations(profile: Any) -> list[Block]:
    """The largest undulations above the noise, falling; all of them where the noise is not known."""
    spectrum, known = profile.harmonics(), np.isfinite(profile.noise_sd)
    largest = above_noise(spectrum, _LARGEST) if known else spectrum.largest(_LARGEST)
    if not largest:
        return [Sentences(["No undulation is above the noise of the readings."])]
    columns = (
        Amounts.of("upr", [int(upr) for upr, _ in largest], heading="undulations per revolution"),
        Amounts.of("amplitude", [amplitude for _, amplitude in largest], "mm"),
    )
    noise = "above the noise of the readings" if known else "(the noise of the deviations is not known)"
    return [AmountTable(f"Largest undulations {noise}", columns)]
