"""Loops with their bounds: over ranges and tuples, and `while`."""

import ast
import re
from abc import abstractmethod

from sdpgrind.codegen._translate.assignments import Assignments
from sdpgrind.codegen._translate.body import Variable
from sdpgrind.codegen._translate.types import (
    INT64,
    Tuple,
)
from sdpgrind.codegen._translate.values import GUARD, PRIMARY, Value, gathered, literal, within

_AT_MOST = re.compile(r"# at most (.+?)\s*$")


class Loops(Assignments):
    """Translation of loops."""

    @abstractmethod
    def body(self, nodes: list[ast.stmt]) -> None:
        """Translate statements in their order."""

    def repeated(self, node: ast.For) -> None:
        """Translate `for` over a range, or over the items of a tuple."""
        if node.orelse:
            raise self.refused(node, "else after a loop", "use a flag")
        call = node.iter
        if isinstance(call, ast.Call) and isinstance(call.func, ast.Name) and call.func.id == "range":
            self._over_range(node, self.operands(list(call.args)))
            return
        items = self.expression(call)
        if not isinstance(items.type, Tuple):
            raise self.refused(node, "a loop over what is neither range nor tuple", "loop over a range")
        self._over_tuple(node, items)

    def _over_range(self, node: ast.For, ends: list[Value]) -> None:
        if not isinstance(node.target, ast.Name):
            raise self.refused(node, "several variables of a range", "use one")
        ends = [self.converted(node, one, INT64) for one in ends]
        ends = [one if one.count is not None else self.temporary(one) for one in ends]
        start, stop = (literal(0), ends[0]) if len(ends) == 1 else (ends[0], ends[1])
        step = 1 if len(ends) < 3 else ends[2].count
        if not step:
            raise self.refused(node, "a step of a range that is no constant", "state it as a constant")
        name, apart = node.target.id, self._read_outside(node, node.target.id)
        counter = self.fresh() if apart or name == "_" else self.name(name)
        sign, advance = ("<", f"{counter} += {step}") if step > 0 else (">", f"{counter} -= {-step}")
        advance = {1: f"{counter}++", -1: f"{counter}--"}.get(step, advance)
        turns = self._turns(start, stop, step)
        if turns == 0:
            return
        if turns == 1 and not apart and not _leaves(node):
            self._once(node, name, start)
            return
        self._bounded(node, turns)
        with self.block(f"for (int64_t {counter} = {start.code}; {counter} {sign} {stop.code}; {advance})"):
            self._loop_variable(node, name, counter, apart)
            self.body(node.body)

    def _once(self, node: ast.For, name: str, start: Value) -> None:
        """Translate the body of a loop of one turn: its variable is a number."""
        before = self.variables.get(name)
        self.variables[name] = Variable(INT64, start.count)
        self.body(node.body)
        if before is None:
            del self.variables[name]
        else:
            self.variables[name] = before

    def _loop_variable(self, node: ast.For, name: str, counter: str, apart: bool) -> None:
        if apart:
            self.assign(node, name, Value(counter, INT64))
        elif name != "_":
            self.joined(node, name, Value(counter, INT64))

    def _read_outside(self, node: ast.For, name: str) -> bool:
        """Whether the variable of a loop is set within it, or read outside of loops over it."""
        inside: set[int] = set()
        for loop in self.source.nodes:
            if isinstance(loop, ast.For) and isinstance(loop.target, ast.Name) and loop.target.id == name:
                inside |= {id(one) for part in [loop.target, *loop.body] for one in ast.walk(part)}
        names = [one for one in self.source.nodes if isinstance(one, ast.Name) and one.id == name]
        sets = [one for one in names if isinstance(one.ctx, ast.Store)]
        loops = [one for one in self.source.nodes if isinstance(one, ast.For) and one.target in sets]
        return len(loops) < len(sets) or any(id(one) not in inside for one in names)

    def _turns(self, start: Value, stop: Value, step: int) -> int | None:
        if start.count is None or stop.count is None:
            return None
        return len(range(start.count, stop.count, step))

    def _over_tuple(self, node: ast.For, items: Value) -> None:
        """Loop over numbers, or over tuples of numbers: a local array for each variable."""
        kind = items.type
        assert isinstance(kind, Tuple)
        targets = node.target.elts if isinstance(node.target, ast.Tuple) else [node.target]
        rows = [self.item(items, k) for k in range(len(kind.types))]
        columns = []
        for place in range(len(targets)):
            cells = [self.item(row, place) if isinstance(node.target, ast.Tuple) else row for row in rows]
            columns.append(self.listed(node, gathered(tuple, tuple(cells))))
        counter = self.fresh()
        self._bounded(node, len(rows))
        with self.block(f"for (int64_t {counter} = 0; {counter} < {len(rows)}; {counter}++)"):
            for target, column in zip(targets, columns, strict=True):
                self.target(target, Value(f"{column.code}[{counter}]", column.type))
            self.body(node.body)

    def repeated_while(self, node: ast.While) -> None:
        """Translate `while`: it is left, with a fault, beyond the bound that its comment states."""
        if node.orelse:
            raise self.refused(node, "else after a loop", "use a flag")
        stated = self._stated(node)
        if stated is None:
            raise self.refused(
                node, "while without a bound", "add a comment behind it: # at most <expression>"
            )
        most = self.converted(node, self.expression(stated), INT64)
        turns, limit = self.fresh(), most if most.count is not None else self.temporary(most)
        self._bounded(node, most.count)
        self.emit(f"int64_t {turns} = 0;")
        with self.apart() as lines:
            test = self.truth(node.test)
        with self.block("for (;;)" if lines else f"while ({test.code})"):
            if lines:
                self.lines += lines
                self.emit(f"if (!{within(test, PRIMARY)}) {{")
                self.emit("    break;")
                self.emit("}")
            self.emit(f"if ({turns} >= {limit.code}) {{ {GUARD}")
            self.emit("    *fault = -2;")
            self.emit("    break;")
            self.emit("}")
            self.emit(f"{turns}++;")
            self.body(node.body)

    def _stated(self, node: ast.stmt) -> ast.expr | None:
        """Return the bound that the comment behind a loop states."""
        found = _AT_MOST.search(self.source.lines[node.lineno - 1])
        return ast.parse(found[1], mode="eval").body if found else None

    def _bounded(self, node: ast.stmt, turns: int | None) -> None:
        """Note the greatest number of turns of a loop, or the text that gives it."""
        stated = self._stated(node)
        within_range = ast.unparse(node.iter) if isinstance(node, ast.For) else ""
        told = within_range if stated is None else ast.unparse(stated)
        self.bounds.append({"line": self.source.line(node), "at_most": told if turns is None else turns})


def _leaves(loop: ast.For) -> bool:
    """Whether a loop is left, or a turn of it cut short."""
    todo: list[ast.AST] = [*loop.body]
    while todo:
        one = todo.pop()
        if isinstance(one, ast.Break | ast.Continue):
            return True
        if not isinstance(one, ast.For | ast.While):
            todo += ast.iter_child_nodes(one)
    return False
