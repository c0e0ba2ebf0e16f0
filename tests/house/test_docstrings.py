"""Every public name says what it is, mentions each parameter, and gives a unit to each quantity."""

import re

from house_names import Public, everything

UNITS = (
    "mm", "mm/s", "mm^2", "mm^3", "mm^3/s", "s", "N", "kg", "rad", "rad/s", "W", "J", "J/mm^3", "$", "$/mm", "1/mm",
    "unit", "units", "Unit", "Units", "probability", "Probability", "probabilities", "ticks", "Ticks", "seconds",
    "dimensionless", "whole number", "dB", "ns", "bytes", "Bytes",
)  # fmt: skip
UNIT = re.compile(
    r"(?<![\w.'])(?:" + "|".join(sorted(map(re.escape, UNITS), key=len, reverse=True)) + r")(?![\w])"
)

# Names that hold no quantity, by what they are instead. Everything else must name a unit.
NO_QUANTITY = {
    "files": r"\.(save|from_file|from_dataset|dataset|close|path)$|^sdpgrind\.load$",
    "pictures": r"\.plot$",
    "yes or no, status, words": r"\.(ok|done|event|problems|notes|message|convex|zero|tiers|identity|names|hidden_names|policy)$",
    "words about a state": r"\.CycleState\.(failed|over)$",
    "a link and who is at its ends": r"\.(closed|reason|tripped|address|attach)$",
    "resetting a state": r"\.reset$",
    "the operator's hand on a run": r"^hwsim\.(Aborted|Live\.(state|pause|resume|abort)|Journal\.ready_for_clock)$",
    "whole structures": r"\.(replace|updated|next|estimate)$",
    "bookkeeping of moves": r"^sdpgrind\.sdp\.Move\.(level_name|levels|lists|choices)$|\.stop_axis$",
    "counts": r"\.(runs|parts|count)$",
}
INNER = {
    "how transitions talk to the solver": r"\.(Shift|Sampled|Stay)\.(rows|sample|arrive|position|quadrature)$",
    "how tables talk to policies on them": r"\.sdp\.Policy\.(act|begin|controls|locate|need_problem|shape|kinks|value_at)$",
}
EXEMPT = {
    "sdpgrind.OldFileWarning": "words about a file",
    "sdpgrind.sdp.Forever": "the absence of a deadline",
    "sdpgrind.sdp.Report": "words",
    "hwsim.check": "says what does not fit",
    "hwsim.compare": "quantities are the plant's own",
    "sdpgrind.BudgetError": "memory",
    "hwsim.Journal": "quantities are the plant's own",
    "hwsim.Journal.log": "quantities are the plant's own",
    "hwsim.OpcuaPlant.start": "a source of random numbers in, a machine out",
    "hwsim.OpcuaPlant.url": "an address",
    "hwsim.opcua.Served": "a server",
    "hwsim.OpcuaPlant.lockstep": "yes or no",
    "hwsim.opcua.Served.url": "an address",
    "hwsim.opcua.Served.stop": "ends a server",
    "hwsim.opcua.make_keys": "keys",
    "hwsim.protocols.Adaptation": "learns between parts",
    "hwsim.protocols.Machine": "quantities are the plant's own",
    "hwsim.protocols.Plant": "quantities are the plant's own",
    "hwsim.protocols.Plant.start": "a source of random numbers in, a machine out",
    "hwsim.protocols.Controller": "quantities are the plant's own",
}
WORDS = {
    "feed_rate": "feed",
    "normal_force": "force",
    "grinding_power": "power",
    "last_duration": "last pass",
    "confidence": "probability",
}
"""What may stand for a parameter in a docstring of one sentence, beside its name with blanks: "at a feed (mm/s)"."""
CONVERSION = re.compile(r"^sdpgrind\.units\.")  # the sentence names what is converted to what

NAMES = everything()


def _inner(each: Public) -> bool:
    """Public by its name only."""
    return "private to this package" in each.doc or any(
        re.search(pattern, each.name) for pattern in INNER.values()
    )


def _delegated(public: Public) -> str:
    """Docstrings that this one names with "see `...`": of a method beside it, or of the same method of that
    class.
    """
    own, _, last = public.name.rpartition(".")
    home = own.rpartition(".")[0]
    texts = re.findall(r"[Ss]ee `([\w.]+)`", public.doc)
    named = [name for text in texts for name in (f"{own}.{text}", f"{home}.{text}.{last}")]
    return "".join(each.doc for each in NAMES if each.name in named)


def _mentioned(parameter: str, doc: str) -> bool:
    words = [parameter, parameter.replace("_", " "), WORDS.get(parameter, parameter)]
    text = " ".join(doc.split())
    return any(re.search(rf"(?<!\w){re.escape(word)}s?(?!\w)", text) for word in words)


def test_they_say_what_they_are():
    silent = {each.name: each.doc for each in NAMES if len(each.doc.split()) < 3}
    assert not silent, f"these docstrings say nothing: {silent}"


def _missing(public: Public) -> list[str]:
    if CONVERSION.match(public.name) or _inner(public):
        return []
    doc = public.doc + _delegated(public)
    return [name for name in public.parameters if not _mentioned(name, doc)]


def test_they_mention_every_parameter():
    missing = {each.name: found for each in NAMES if (found := _missing(each))}
    assert not missing, f"these docstrings do not mention all parameters: {missing}"


def _without_unit(public: Public) -> bool:
    if public.name in EXEMPT or _inner(public):
        return False
    return not UNIT.search(public.doc) and not any(
        re.search(pattern, public.name) for pattern in NO_QUANTITY.values()
    )


def test_they_give_units():
    without = {each.name: each.doc[:200] for each in NAMES if _without_unit(each)}
    assert not without, f"these docstrings name no unit: {without}"


def test_the_test_can_fail():
    bad = Public("bad", lambda force: force, None)
    assert bad.parameters == _missing(bad) == ["force"]
    assert not bad.doc and _without_unit(bad)
    assert not UNIT.search("Return the depth of the pass.")
    assert UNIT.search("Return the depth (mm).")
    assert not UNIT.search("Newton's method, as it were")
    assert _mentioned("feed_rate", "at a feed (mm/s)")
    assert not _mentioned("height", "Return the time (s).")


def test_exemptions_are_still_needed():
    known = {each.name for each in NAMES}
    assert set(EXEMPT) <= known, f"no longer public: {sorted(set(EXEMPT) - known)}"
    without = {each.name for each in NAMES if not UNIT.search(each.doc)}
    assert set(EXEMPT) <= without, f"these give units by now: {sorted(set(EXEMPT) - without)}"
