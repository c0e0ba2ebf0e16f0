"""What cannot be translated is refused, with file, line, construct and what to write instead."""

import ast
import inspect
from functools import cached_property
from pathlib import Path
from typing import Any
from weakref import WeakKeyDictionary


class RefusedKernelError(ValueError):
    """A kernel outside the subset of Python that `export` translates, whatever its units (mm, s, N).

    Parameters
    ----------
    message : str
        File, line, construct, and what to write instead.
    """

    def __init__(self, message: str) -> None:
        super().__init__(message)


WORDS: dict[type, tuple[str, str]] = {
    ast.Raise: ("raise", "return a status"),
    ast.Assert: ("assert", "check the value where it is handed over"),
    ast.Try: ("try", "return a status"),
    ast.With: ("with", "leave it out"),
    ast.Lambda: ("lambda", "write a kernel"),
    ast.FunctionDef: ("a function within a function", "write a kernel of its own"),
    ast.ListComp: ("a comprehension", "write the loop"),
    ast.GeneratorExp: ("a generator", "write the loop"),
    ast.List: ("a list", "use np.empty with a constant size, or a tuple"),
    ast.Dict: ("a dict", "use a NamedTuple"),
    ast.Set: ("a set", "use comparisons"),
    ast.JoinedStr: ("text", "leave it out"),
    ast.Delete: ("del", "leave it out"),
    ast.Starred: ("a starred item", "name the items"),
    ast.NamedExpr: (":=", "assign in a statement of its own"),
    ast.MatMult: ("@", "write the loop"),
    ast.In: ("in", "use comparisons"),
    ast.NotIn: ("not in", "use comparisons"),
    ast.Is: ("is", "use =="),
    ast.IsNot: ("is not", "use !="),
}
"""Construct -> (its name, what to write instead)."""


class KernelSource:
    """Text of a kernel: its tree, its file and its lines.

    `text`: what stands in its place, written out for the constants of one recipe.
    """

    def __init__(self, kernel: Any, text: str = "") -> None:
        function = kernel.py_func
        lines, self.first = inspect.getsourcelines(function)
        self.lines = lines = text.splitlines(keepends=True) or lines
        self.written_out = bool(text)
        indent = len(lines[0]) - len(lines[0].lstrip())
        self.text = "".join(line[indent:] if line.strip() else line for line in lines)
        self.tree: ast.FunctionDef = next(
            one for one in ast.parse(self.text).body if isinstance(one, ast.FunctionDef)
        )
        self.file = shown_file(function)
        self.nodes = list(ast.walk(self.tree))
        names = [one for one in self.nodes if isinstance(one, ast.Name)]
        updated = [one.target for one in self.nodes if isinstance(one, ast.AugAssign)]
        self.read = {one.id for one in names if isinstance(one.ctx, ast.Load)}
        self.read |= {one.id for one in updated if isinstance(one, ast.Name)}

    @cached_property
    def tested(self) -> set[str]:
        """Names that are compared with a constant, or whose truth is asked, by themselves."""
        found: set[str] = set()
        stored = {
            one.id for one in self.nodes if isinstance(one, ast.Name) and isinstance(one.ctx, ast.Store)
        }
        variables = stored | {one.arg for one in self.tree.args.args}
        for one in self.nodes:
            parts = [one.test] if isinstance(one, ast.If | ast.IfExp) else []
            parts += one.values if isinstance(one, ast.BoolOp) else []
            if isinstance(one, ast.Compare):
                sides = [one.left, *one.comparators]
                named = [
                    {inner.id for inner in ast.walk(side) if isinstance(inner, ast.Name)} for side in sides
                ]
                parts += sides if any(not names & variables for names in named) else []
            parts += [one.operand] if isinstance(one, ast.UnaryOp) and isinstance(one.op, ast.Not) else []
            found |= {part.id for part in parts if isinstance(part, ast.Name)}
        return found

    def line(self, node: ast.AST) -> int:
        """Return the line of a node in its file."""
        return self.first + int(getattr(node, "lineno", 1)) - 1

    def refused(self, node: ast.AST, construct: str, remedy: str) -> RefusedKernelError:
        """Return the error for a construct."""
        return RefusedKernelError(
            f"{self.file}, line {self.line(node)}: {construct} is not translated; {remedy}"
        )

    def unknown(self, node: ast.AST) -> RefusedKernelError:
        """Return the error for a construct that has no translation."""
        construct, remedy = WORDS.get(type(node), (type(node).__name__, "see the subset in the docs"))
        return self.refused(node, construct, remedy)


_sources: WeakKeyDictionary[Any, KernelSource] = WeakKeyDictionary()


def source_of(kernel: Any, text: str) -> KernelSource:
    """Return the source of a kernel, which is read once for all exports; a text in its place is read anew."""
    if text:
        return KernelSource(kernel, text)
    if kernel not in _sources:
        _sources[kernel] = KernelSource(kernel)
    return _sources[kernel]


def shown_file(function: Any) -> str:
    """Return the file of a function from its package on, the same on every machine."""
    path = Path(inspect.getsourcefile(function) or "")
    depth = function.__module__.count(".") + 1 if function.__module__ != "__main__" else 1
    return "/".join(path.parts[-depth:])


def check_options(source: KernelSource, kernel: Any) -> None:
    """Refuse options under which machine code differs from C: they come with the decorator."""
    options = kernel.targetoptions
    if options.get("fastmath"):
        raise source.refused(source.tree, "fastmath", "leave it out: its bits are those of one compiler")
    if options.get("parallel"):
        raise source.refused(source.tree, "parallel", "leave it out: sums then depend on the machine")


def check_division(source: KernelSource, kernel: Any, node: ast.AST) -> None:
    """Refuse a division that raises in Python and goes on in C."""
    if kernel.targetoptions.get("error_model") != "numpy":
        raise source.refused(
            node,
            "a division under the default error model",
            f"decorate {kernel.py_func.__name__} with error_model='numpy' and guard a divisor that can be 0",
        )
