"""Budget of memory: a job that would take more than may be used is refused before it is begun."""

import os
from pathlib import Path

_SHARE = 0.5  # of the free memory; chosen: the rest is for copies, and for other programs
_ALWAYS = 2.0**26  # bytes; chosen: any computer has 64 MiB, and the question takes longer than the work
_GROUP = Path("/sys/fs/cgroup")  # of a container: what it may use and what it uses


class BudgetError(ValueError):
    """A job would take more memory than this computer has to spare.

    Parameters
    ----------
    message : str
        What was asked for, what it would take and what is free (GiB), and what to change.

    Examples
    --------
    >>> import sdpgrind
    >>> from sdpgrind import weldbead
    >>> try:
    ...     weldbead.plan(weldbead.preset("P1"), nodes=10**9)
    ... except sdpgrind.BudgetError as error:
    ...     print(str(error)[:44])
    a grid of 1e+09 nodes must take less memory:
    """

    def __init__(self, message: str) -> None:
        super().__init__(message)


def afford(what: str, size: float, advice: str) -> None:
    """Refuse what takes more than half of the free memory.

    Parameters
    ----------
    what : str
        What is asked for, as the sentence begins: "runs = 1e9".
    size : float
        Bytes that it would take.
    advice : str
        What to change.

    Raises
    ------
    BudgetError
        When it does not fit.
    """
    if size < _ALWAYS:
        return
    most = _SHARE * free_memory()
    if size > most:
        told = f"it would be {_gib(size)}, and half of what is free is {_gib(most)}"
        raise BudgetError(f"{what} must take less memory: {told}; {advice}")


def free_memory() -> float:
    """Return the bytes that this process could still use: of the computer, or of its container."""
    return min(_of_computer(), _of_container())


def _of_computer() -> float:
    try:
        lines = Path("/proc/meminfo").read_text(encoding="ascii").splitlines()
        told = dict(line.split(":", 1) for line in lines)
        return float(told["MemAvailable"].split()[0]) * 1024.0
    except (OSError, KeyError, ValueError):
        pass
    try:  # elsewhere the whole memory is known, not what is free of it
        return float(os.sysconf("SC_PHYS_PAGES")) * os.sysconf("SC_PAGE_SIZE")
    except (AttributeError, OSError, ValueError):
        return float("inf")


def _of_container() -> float:
    try:
        most, used, told = ((_GROUP / f"memory.{name}").read_text() for name in ("max", "current", "stat"))
        parts = dict(line.split() for line in told.splitlines())
        files = float(parts["active_file"]) + float(parts["inactive_file"])  # given up when it is needed
        return float(most) - float(used) + files
    except (OSError, ValueError, KeyError):  # no container, or "max": as much as there is
        return float("inf")


def _gib(size: float) -> str:
    return f"{size / 2**30:.3g} GiB"
