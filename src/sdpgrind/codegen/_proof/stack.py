"""Stack of an export as gcc lays it out: the deepest sum of frames along the calls."""

import re
from contextlib import suppress
from functools import cache
from pathlib import Path

from sdpgrind.codegen._proof.compilers import compiled

_NODE = re.compile(
    r'node: \{ title: "(?:[^":]*:)?([^"]+)" label: "[^"]*?(\d+) bytes \((?:static|dynamic,bounded)\)'
)
_EDGE = re.compile(r'edge: \{ sourcename: "(?:[^":]*:)?([^"]+)" targetname: "(?:[^":]*:)?([^"]+)"')


TELLING = ("-fstack-usage", "-fcallgraph-info=su")
"""Flags by which gcc, since its version 10, writes frames and calls beside what it builds."""


def stack_of(compiler: str, source: Path, folder: Path, name: str, level: str = "-O2") -> int | None:
    """Return the bytes of stack of a step; None where the compiler does not tell."""
    with suppress(RuntimeError):
        compiled(compiler, [source / f"{name}.c"], folder / f"{name}.o", "-c", *TELLING, *level.split())
    return stack_told(folder, name)


def stack_told(folder: Path, name: str) -> int | None:
    """Return the bytes of stack of a step that was built in a folder; None: nothing is told of it."""
    told = [path.read_text() for path in folder.glob("*.ci") if path.stem.rpartition("-")[2] == name]
    return _deepest("".join(told), f"{name}_step") if told else None


def _deepest(graph: str, step: str) -> int:
    frames = {name: int(size) for name, size in _NODE.findall(graph)}
    calls: dict[str, set[str]] = {}
    for caller, callee in _EDGE.findall(graph):
        calls.setdefault(caller, set()).add(callee)

    @cache
    def depth(name: str) -> int:
        return frames.get(name, 0) + max(map(depth, calls.get(name, ())), default=0)

    return depth(step)
