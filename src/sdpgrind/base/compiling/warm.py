"""Compile before the first use, by a small example of an area's work."""

from importlib import import_module

from sdpgrind.base import checks
from sdpgrind.base.progress import Portions, Progress, ProgressOption, reported

# area -> package, whose module ``_first_use`` has the example
HOMES = {
    "weldbead": "sdpgrind.weldbead",
    "plunge": "sdpgrind.plunge",
    "locus": "sdpgrind.locus",
    "finishing": "sdpgrind.finishing",
    "centering": "centering",
}
# measured: kernels that each first use compiles on an empty cache (benchmarks/times.py); shares follow them
KERNELS = {"weldbead": 85, "plunge": 62, "locus": 94, "finishing": 89, "centering": 315}


def warm(area: str | None = None, progress: ProgressOption = None) -> dict[str, int]:
    """Compile what the first use of an area would compile, for some half a minute each, once on a machine.

    Kernels are compiled at their first call and kept on disk. Call this at installation where a first plan
    must not wait. After an interruption the compiled kernels stay.

    Parameters
    ----------
    area : str, optional
        ``"weldbead"``, ``"plunge"``, ``"locus"``, ``"finishing"`` or ``"centering"``. Default: all of them.
    progress : callable, True or None
        Called with the completed share (0..1) and a text: ``"compiling locus, once on this machine: 12
        kernels so far"``. True: a line, in a pipe every few seconds. Default: the same without a share, after
        two seconds of compiling.

    Returns
    -------
    dict
        Number of compiled kernels by area; 0: all were on disk.

    Raises
    ------
    ValueError
        When there is no such area.

    Examples
    --------
    >>> import sdpgrind
    >>> sdpgrind.warm("plunge")  # doctest: +SKIP
    {'plunge': 62}
    """
    areas = [checks.one_of("area", area, HOMES)] if area is not None else list(HOMES)
    if progress is None:
        return {name: first_use(name) for name in areas}
    with reported(progress) as tell:
        portions, found = Portions(tell), {}
        for k, name in enumerate(areas):
            part = portions.next(KERNELS[name], sum(KERNELS[later] for later in areas[k + 1 :]))
            found[name] = first_use(name, part)
            part(1.0, f"{name}: compiled")
        return found


def first_use(area: str, progress: Progress | None = None) -> int:
    """Run the example of an area; return the number of kernels that it compiled."""
    from sdpgrind.base.compiling.compile_line import listener

    before = listener.count
    with listener.of(area, progress, KERNELS[area]):
        import_module(f"{HOMES[area]}._first_use").first_use()
    return listener.count - before
