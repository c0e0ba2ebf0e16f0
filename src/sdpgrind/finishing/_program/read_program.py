"""Read programs of robots from files or texts; shares nothing with their writers."""

import os
import re
from pathlib import Path

from sdpgrind.base import checks
from sdpgrind.finishing._program.program_path import ProgramPath
from sdpgrind.finishing._program.read_krl import called, read_krl
from sdpgrind.finishing._program.read_rapid import read_rapid
from sdpgrind.finishing._program.read_table import read_table
from sdpgrind.finishing._program.read_trajectory import read_trajectory
from sdpgrind.finishing._program.read_urscript import read_urscript

_READERS = {
    "urscript": read_urscript,
    "rapid": read_rapid,
    "krl": read_krl,
    "csv": read_table,
    "ros": read_trajectory,
}
_MARKS = (
    (r"def \w+\(\):", "urscript"),
    (r"MODULE \w+", "rapid"),
    (r"DEF \w+\(\)", "krl"),
    (r"time_s,", "csv"),
    (r"\{", "ros"),
)


def read_program(path: str | os.PathLike[str]) -> ProgramPath:
    r"""Read a program of a robot as its controller would: URScript, RAPID, KRL, a table or ROS.

    Read is what `Motion.program` writes, also where it was changed by hand. A statement that is not
    understood is refused. Numbers of RAPID and KRL are kept in single precision, as their controllers do.

    Parameters
    ----------
    path : str or path
        The file.

    Returns
    -------
    ProgramPath
        Its moves, mm, s, rad; ``.check(motion)`` compares them with a motion.

    Raises
    ------
    ValueError
        When the file is no such program, with the line.
    FileNotFoundError
        When there is no such file, or none beside a KRL program for one that it calls.

    Examples
    --------
    >>> from pathlib import Path
    >>> from tempfile import TemporaryDirectory
    >>> from sdpgrind import finishing
    >>> with TemporaryDirectory() as folder:
    ...     file = Path(folder) / "joints.csv"
    ...     _ = file.write_text("time_s,q1_rad,X_mm\n0,0.1,5\n0.5,0.2,6\n")
    ...     path = finishing.read_program(file)
    >>> path.target, path.time.tolist(), path.joints.tolist()  # s, rad, mm
    ('csv', [0.0, 0.5], [[0.1, 5.0], [0.2, 6.0]])
    """
    file = checks.path("path", path)
    text = _ascii(file)
    if file.suffix.lower() == ".src":
        text += "".join(_ascii(file.with_name(f"{name}.src")) for name in called(text))
    return read_text(text)


def _ascii(file: Path) -> str:
    """Text of a file in ASCII."""
    try:
        return file.read_bytes().decode("ascii")
    except UnicodeDecodeError as error:
        rule = "a program in ASCII, as controllers read it"
        raise checks.refuse("path", rule, f"{file.name} with byte {error.start}") from None


def read_text(text: str) -> ProgramPath:
    """Read a program from its text."""
    for line in text.splitlines():
        for mark, target in _MARKS:
            if re.match(mark, line.strip()):
                return _READERS[target](text)
    raise ValueError(
        "text must be a program in URScript (def ...():), RAPID (MODULE ...), KRL (DEF ...()), a table"
        " (time_s,...) or JSON of ROS ({...}); got none of these"
    )
