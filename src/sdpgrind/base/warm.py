"""Compile before the first use: what an area needs is compiled by a small piece of its real work."""

from importlib import import_module

from sdpgrind.base import checks
from sdpgrind.base.progress import Progress

# Where an area is; its module ``_first_use`` has the piece of work.
HOMES = {
    "weldbead": "sdpgrind.weldbead",
    "plunge": "sdpgrind.plunge",
    "locus": "sdpgrind.locus",
    "finishing": "sdpgrind.finishing",
    "centering": "centering",
}


def warm(area: str | None = None, progress: Progress | None = None) -> dict[str, int]:
    """Compile what the first use of an area would compile, for up to half a minute each, once on a machine.

    A kernel is compiled when it is first called and kept on disk. Where a first plan must not wait, as on a machine that
    is about to run, call this when the library is installed. What was compiled stays where this is broken off.

    Parameters
    ----------
    area : str, optional
        ``"weldbead"``, ``"plunge"``, ``"locus"``, ``"finishing"`` or ``"centering"``. Default: all of them.
    progress : callable, optional
        Called with the share done (0..1) and a short text such as ``"compiling locus, once on this machine: 12 of 45"``.
        Default: a line on a terminal, after two seconds.

    Returns
    -------
    dict
        Number of kernels that were compiled, by area; 0 where all were on disk.

    Raises
    ------
    ValueError
        If there is no such area.

    Examples
    --------
    >>> import sdpgrind
    >>> sdpgrind.warm("plunge")  # doctest: +SKIP
    {'plunge': 37}
    """
    areas = [checks.one_of("area", area, HOMES)] if area is not None else list(HOMES)
    return {name: first_use(name, progress) for name in areas}


def first_use(area: str, progress: Progress | None = None) -> int:
    """Do the piece of work of one area and return how many kernels it compiled."""
    from sdpgrind.base.compile_line import listener, told

    before = listener.count
    with told(area, progress):
        import_module(f"{HOMES[area]}._first_use").first_use()
    return listener.count - before
