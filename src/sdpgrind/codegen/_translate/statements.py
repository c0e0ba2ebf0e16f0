"""Statements: their order, conditions, returns, and the function that they make."""

import ast
import re
from dataclasses import replace

from sdpgrind.codegen._translate.body import CLine, Variable, root_of
from sdpgrind.codegen._translate.loops import Loops
from sdpgrind.codegen._translate.types import (
    INT64,
    Array,
    Known,
    Nothing,
    RowType,
    Scalar,
    Type,
    unified,
)
from sdpgrind.codegen._translate.values import GUARD, Value, cast, identical

_GUARD = re.compile(r"# guard\b")
_LEFT = re.compile(r"(return|break|continue)\b")
_BY_NODE = {
    ast.Assign: "assigned", ast.AnnAssign: "annotated", ast.AugAssign: "updated", ast.Expr: "evaluated",
    ast.If: "branched", ast.For: "repeated", ast.While: "repeated_while", ast.Return: "returned",
}  # fmt: skip
"""Node -> method that translates it."""


class Statements(Loops):
    """Translation of statements."""

    expected_never: bool = False
    """Whether a comment says that nothing is to reach what is translated."""

    def body(self, nodes: list[ast.stmt]) -> None:
        """Translate statements in their order."""
        for node in nodes:
            if isinstance(node, ast.Break | ast.Continue):
                self.emit("break;" if isinstance(node, ast.Break) else "continue;")
            elif not isinstance(node, ast.Pass):
                name = _BY_NODE.get(type(node))
                if name is None:
                    raise self.source.unknown(node)
                self._translated(node, name)
            if self.lines and self.lines[-1].depth == self.depth and _LEFT.match(self.lines[-1].text):
                return  # what follows a known condition may never be reached

    def _translated(self, node: ast.stmt, name: str) -> None:
        before, outside = len(self.lines), self.expected_never
        named = any(_GUARD.search(line) for line in self.source.lines[node.lineno - 1 : _head(node)])
        self.expected_never = outside or named
        getattr(self, name)(node)
        self.expected_never = outside
        if named:
            self._guard(before)

    def _guard(self, before: int) -> None:
        """Say at the first branch from a line on that nothing is to reach it."""
        for k, line in enumerate(self.lines[before:], before):
            if re.match(r"if |\} else if ", line.text) or " ? " in line.text or " && " in line.text:
                self.lines[k] = replace(line, text=f"{line.text} {GUARD}")
                return

    def evaluated(self, node: ast.Expr) -> None:
        """Call for what a kernel does; docstrings are written above the function."""
        if not isinstance(node.value, ast.Constant):
            self.expression(node.value)

    def branched(self, node: ast.If) -> None:
        """Translate `if`; a condition that is known leaves one branch."""
        test = self.truth(node.test)
        if isinstance(test.number, bool):
            self.body(node.body if test.number else node.orelse)
            return
        self.emit(f"if ({test.code}) {{")
        self.depth += 1
        self.body(node.body)
        self.depth -= 1
        if node.orelse:
            with self.apart() as lines:
                self.body(node.orelse)
            if len(node.orelse) == 1 and lines and lines[0].text.startswith("if ("):
                self.emit("} else " + lines[0].text)
                self.lines += [replace(line, depth=line.depth - 1) for line in lines[1:]]
                return
            self.emit("} else {")
            self.lines += lines
        self.emit("}")

    # -- results ---------------------------------------------------------------------------------------

    def returned(self, node: ast.Return) -> None:
        """Return a value of the type of all results."""
        value = Value("", Nothing()) if node.value is None else self.expression(node.value)
        kind: Type | None = value.type if self.result is None else unified(self.result, value.type)
        if kind is None or isinstance(kind, RowType):
            raise self.refused(node, "results of two types", "return the same in all branches")
        self._check_alive(node, value)
        self.returns.append(value)
        self.refuses |= not self.expected_never and (value.number is None or value.number < 0)
        if kind != self.result:
            self.result, self.changed = kind, True
        text = (
            "return;"
            if isinstance(kind, Nothing)
            else f"return {self.text(self.converted(node, value, kind))};"
        )
        self.emit(text)

    def _check_alive(self, node: ast.AST, value: Value) -> None:
        """Refuse to return an array that ends with the kernel."""
        for one in [value, *(value.items or ())]:
            if isinstance(one.type, Array) and one.root and one.root not in self.parameters:
                raise self.refused(node, "returning an array of its own", "hand over an array that is filled")

    # -- the function ----------------------------------------------------------------------------------

    def view(self, lines: list[CLine]) -> tuple[int, int] | None:
        """Return parameter and place where the kernel does nothing but return a view of an array."""
        value = self.returns[0] if len(self.returns) == len(lines) == 1 else None
        if value is None or not root_of(value) or value.terms or value.code not in self.parameters:
            return None
        return self.parameters.index(value.code), value.at

    def number(self) -> int | float | bool | None:
        """Return the number that the kernel returns, where it is always the same."""
        values = [cast(one, self.result or Nothing()) for one in self.returns]
        found = [None if one is None else one.number for one in values]
        same = bool(found) and all(identical(one, found[0]) for one in found)
        return found[0] if same else None

    def least(self) -> int | float | None:
        """Return the least number that the kernel returns, where all are known."""
        found = [one.number for one in self.returns]
        known = [one for one in found if one is not None]
        return min(known) if known and len(known) == len(found) else None

    parameters: tuple[str, ...] = ()
    """Names in C of the parameters."""

    def declare(self, kinds: tuple[Type, ...], numbers: tuple[int | float | bool | None, ...]) -> None:
        """Set the parameters; those whose number is known are none."""
        names = [one.arg for one in self.source.tree.args.args]
        self.parameters = tuple(self.name(one) for one in names)
        for k, (name, kind) in enumerate(zip(names, kinds, strict=True)):
            root = self.name(name) if isinstance(kind, Array | RowType) else ""
            self.variables[name] = Variable(kind, numbers[k], root)

    def begin(self) -> None:
        """Forget the lines, not the types: another pass over the kernel."""
        super().begin()
        self.returns: list[Value] = []
        self.expected_never = self.refuses = False
        self.declared = {one.arg for one in self.source.tree.args.args}

    def tops(self) -> list[CLine]:
        """Return declarations of variables that are first set within a block."""
        found = []
        for name, kind in self.on_top.items():
            text = self.declaration(self.name(name), kind, self.variables[name].root)
            zero = {"bool": "false", "double": "0.0"}.get(kind.c, "0") if isinstance(kind, Scalar) else ""
            start = f" = {zero}" if zero else " = NULL" if isinstance(kind, Array | RowType) else ""
            found.append(CLine(f"{text}{start};", 1, self.name(name)))
        return found

    def signature(self, name: str, kinds: tuple[Type, ...], result: Type, faults: bool) -> str:
        """Return the head of the function."""
        parts = [
            self.declaration(one, kind, one)
            for one, kind in zip(self.parameters, kinds, strict=True)
            if not isinstance(kind, Known)
        ] + (["int32_t *fault"] if faults else [])
        spelled = self.program.spelled(result)
        return f"static {spelled}{'' if spelled.endswith('*') else ' '}{name}({', '.join(parts) or 'void'})"

    def unused(self, lines: list[CLine]) -> list[str]:
        """Return lines that say which parameters are not used."""
        words = set(re.findall(r"[A-Za-z_]\w*", " ".join(line.text for line in lines)))
        return [
            f"    (void){one};"
            for one in self.parameters
            if one not in words and not isinstance(self.variables.get(one, Variable(INT64)).type, Known)
        ]

    def comment(self) -> str:
        """Return the docstring as a comment."""
        where = f"{self.kernel.py_func.__name__}, {self.source.file}"
        told = (ast.get_docstring(self.source.tree) or "").replace("*/", "* /")
        return "\n".join(["/*", *(f" * {line}".rstrip() for line in [*told.splitlines(), where]), " */"])


def _head(node: ast.stmt) -> int:
    """Return the last line of a statement, or of the condition of `if`."""
    inner = node.test if isinstance(node, ast.If) else node
    return inner.end_lineno or node.lineno
