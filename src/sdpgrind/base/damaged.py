"""Damaged files: the error of one that is not as it was written, the warning of one that cannot tell."""

import os


class DamagedFileError(ValueError):
    """A file is not as it was written: flipped bits, a lost end, blocks of another file.

    Parameters
    ----------
    path : str or path
        The damaged file.
    wrong : str
        What is wrong.
    salvage : str
        What can still be had from it, and how.

    Examples
    --------
    >>> import pathlib, sdpgrind, tempfile
    >>> from sdpgrind import plunge
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     path = pathlib.Path(folder, "cycle.nc")
    ...     plunge.plan(plunge.preset("simulation")).save(path)
    ...     _ = path.write_bytes(path.read_bytes()[:-1])  # the last byte is lost
    ...     try:
    ...         sdpgrind.load(path)
    ...     except sdpgrind.DamagedFileError as error:
    ...         error.wrong
    'its digest is not that of its bytes'
    """

    path: str
    """The damaged file."""
    wrong: str
    """What is wrong."""
    salvage: str
    """What can still be had from it, and how."""

    def __init__(self, path: str | os.PathLike[str], wrong: str, salvage: str) -> None:
        self.path, self.wrong, self.salvage = os.fspath(path), wrong, salvage
        super().__init__(self.path, wrong, salvage)  # as `pickle` gives them back

    def __str__(self) -> str:
        return f"{self.path!r} is damaged: {self.wrong}; {self.salvage}"


class OldFileWarning(UserWarning):
    """A file of version 0.1.0 was read: it has no digest, so damage cannot be seen.

    Save it again, and it has one.

    Parameters
    ----------
    message : str
        Which file.

    Examples
    --------
    >>> import warnings, sdpgrind
    >>> warnings.filterwarnings("ignore", category=sdpgrind.OldFileWarning)  # doctest: +SKIP
    """

    def __init__(self, message: str) -> None:
        super().__init__(message)
