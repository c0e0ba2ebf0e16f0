"""Page of a plan or another record: status, figures, picture, problem, versions, digest."""

import hashlib
import os
from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

import numpy as np

from sdpgrind.base.columns.source import Source
from sdpgrind.base.sheets import page
from sdpgrind.base.sheets.amounts import Amounts
from sdpgrind.base.sheets.blocks import AmountTable, Blanks, Block, Embedded, Heading, Picture, Sentences
from sdpgrind.base.sheets.origin import plain_of, problem_blocks, versions, versions_table

if TYPE_CHECKING:
    import xarray as xr


SIGNATURE = Blanks(("name", "date", "signature"))


def report(record: Any, path: str | os.PathLike[str] | None, more: tuple[Block, ...] = ()) -> str:
    """Write the page of a record, or return its text; `more` blocks follow the figures."""
    written: str = page.report(title_of(record), blocks_of(record, more), path)
    return written


def title_of(record: Any) -> str:
    """Return the title of a record, else its kind in words; with the file from which its data are."""
    title = record._title or str(record.kind).replace(".", " ").replace("_", " ").capitalize()
    source = getattr(record, "source", None)
    files = [note.name for note in source.files if note.sha256] if isinstance(source, Source) else []
    return f"{title}: {', '.join(files[:1])}{' ...' * (len(files) > 1)}" if files else title


def headline_of(record: Any) -> str:
    """Return the verdict of a record in one line: its own, its status, or what stands in its `repr`."""
    if callable(own := getattr(record, "_headline", None)):
        return str(own())
    name = f"{type(record).__name__}("
    shown = repr(record)
    inside = shown[len(name) : -1] if shown.startswith(name) else shown
    return str(getattr(record, "status", "")) or inside


def blocks_of(record: Any, more: tuple[Block, ...] = ()) -> Iterator[Block]:
    """Yield all blocks of the page of a record."""
    dataset = record._written()
    yield Sentences([headline_of(record)], strong=True)
    yield from record._figures()
    if numbers := [*_numbers(dataset)]:
        yield AmountTable("Figures", numbers, ("figure", "value"))
    yield from more
    if callable(draw := getattr(record, "plot", None)):
        yield Heading("Picture")
        yield Picture(title_of(record), draw)
    if (problem := getattr(record, "problem", None)) is not None:
        yield from problem_blocks(problem, dataset.attrs.get("problem"))
    yield Heading("Origin")
    yield versions_table()
    solved = solved_of(record, dataset)
    yield Sentences([f"sha256 of the arrays: {solved['arrays']}"])
    yield Embedded("plan", {**solved, **versions()})
    yield SIGNATURE


def _numbers(dataset: "xr.Dataset") -> Iterator[Amounts]:
    """Yield the single numbers of a dataset."""
    for name, variable in dataset.data_vars.items():
        if variable.dims == () and variable.dtype.kind in "fiu":
            words = str(variable.attrs.get("long_name", name)).replace("_", " ")
            yield Amounts.of(str(name), [variable.item()], str(variable.attrs.get("units", "")), words)


def solved_of(plan: Any, dataset: "xr.Dataset") -> dict[str, Any]:
    """Return kind, digest of the arrays, and method of a plan where it tells one, for JSON.

    ``options``: those that it was solved with; None: they are not known, or no plain values.
    """
    method = {"method": str(dataset.attrs["method"])} if "method" in dataset.attrs else {}
    known = getattr(plan, "_options", None)
    options = None if known is None else plain_of(known)
    return {"kind": plan.kind, "arrays": arrays_digest(dataset), **method, "options": options}


def arrays_digest(dataset: "xr.Dataset") -> str:
    """Return a SHA-256 of names, dimensions, types and bits of all arrays of a dataset."""
    digest = hashlib.sha256()
    for name in sorted(map(str, dataset.variables)):
        variable = dataset[name]
        values = np.ascontiguousarray(variable.values)
        words = values.dtype.kind in "OU"  # objects in some files, arrays of texts in others
        digest.update(
            f"{name} {variable.dims} {'text' if words else values.dtype.str} {values.shape}\n".encode()
        )
        digest.update(repr(values.tolist()).encode() if words else values.tobytes())
    return digest.hexdigest()
