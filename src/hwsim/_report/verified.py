"""A page checked: what was changed in it since it was written, in sentences."""

import json
import os
from pathlib import Path
from typing import Any

from sdpgrind.base.sheets import seal

_MOST = 100_000_000  # bytes; chosen: no page of ours has a hundredth of it


def verified(path: str | os.PathLike[str]) -> list[str]:
    """Return a sentence for each change of the page at `path`; empty: it is as it was written.

    Raises
    ------
    FileNotFoundError
        When there is no such file.
    ValueError
        When the file is no page of ours.
    """
    return seal.changes(_text(path))


def read(path: str | os.PathLike[str]) -> dict[str, Any]:
    """Return the data of the page at `path` by name."""
    return {name: json.loads(text) for name, text in seal.data(_text(path)).items()}


def _text(path: str | os.PathLike[str]) -> str:
    file = Path(path)
    if not file.is_file():
        raise FileNotFoundError(f"the page must be an existing file; got {str(file)!r}")
    if file.stat().st_size > _MOST:
        raise ValueError(f"the page must be a report of this library; {str(file)!r} has over 100 MB")
    try:
        return file.read_bytes().decode("utf-8")
    except UnicodeDecodeError:
        raise ValueError(f"the page must be a report of this library; {str(file)!r} is no text") from None
