"""Statements: assignments, conditions, loops with their bounds, returns."""

import ast
import re
from dataclasses import replace

from sdpgrind.codegen._translate.body import CLine, Variable, root_of
from sdpgrind.codegen._translate.expressions import Expressions
from sdpgrind.codegen._translate.types import (
    INT64,
    Array,
    Known,
    Nothing,
    RowType,
    Scalar,
    Tuple,
    Type,
    unified,
)
from sdpgrind.codegen._translate.values import PRIMARY, Value, literal, within

_AT_MOST = re.compile(r"# at most (.+?)\s*$")
_BY_NODE = {
    ast.Assign: "assigned", ast.AnnAssign: "annotated", ast.AugAssign: "updated", ast.Expr: "evaluated",
    ast.If: "branched", ast.For: "repeated", ast.While: "repeated_while", ast.Return: "returned",
}  # fmt: skip
"""Node -> method that translates it."""
_MAKERS = ("np.empty", "np.zeros", "np.ones")


class Statements(Expressions):
    """Translation of statements."""

    def body(self, nodes: list[ast.stmt]) -> None:
        """Translate statements in their order."""
        for node in nodes:
            if isinstance(node, ast.Break | ast.Continue):
                self.emit("break;" if isinstance(node, ast.Break) else "continue;")
            elif not isinstance(node, ast.Pass):
                name = _BY_NODE.get(type(node))
                if name is None:
                    raise self.source.unknown(node)
                getattr(self, name)(node)

    def evaluated(self, node: ast.Expr) -> None:
        """Call for what a kernel does; docstrings are written above the function."""
        if not isinstance(node.value, ast.Constant):
            self.expression(node.value)

    # -- assignments -----------------------------------------------------------------------------------

    def assigned(self, node: ast.Assign) -> None:
        """Set names, elements, fields, views, from one value or from a tuple."""
        single = node.targets[0] if len(node.targets) == 1 else None
        made = isinstance(node.value, ast.Call) and ast.unparse(node.value.func) in _MAKERS
        if isinstance(single, ast.Name) and made and self._sets(single.id) == 1:
            self.hint = single.id
        value = self.expression(node.value)
        self.hint = ""
        if len(node.targets) > 1 and value.level < PRIMARY:
            value = self.temporary(value)
        for target in node.targets:
            self.target(target, value)

    def annotated(self, node: ast.AnnAssign) -> None:
        """Set a name that has an annotation."""
        if node.value is not None:
            self.target(node.target, self.expression(node.value))

    def _sets(self, name: str) -> int:
        named = (one for one in self.source.nodes if isinstance(one, ast.Name) and one.id == name)
        return sum(isinstance(one.ctx, ast.Store) for one in named)

    def target(self, node: ast.expr, value: Value) -> None:
        """Set what stands on the left."""
        if isinstance(node, ast.Tuple):
            self._unpacked(node, value)
        elif isinstance(node, ast.Name):
            self._named(node, value)
        elif isinstance(node, ast.Subscript | ast.Attribute):
            self.stored(node, self._place(node), value)
        else:
            raise self.source.unknown(node)

    def _named(self, node: ast.Name, value: Value) -> None:
        if value.code == self.name(node.id) and isinstance(value.type, Array):  # made under this name
            self.joined(node, node.id, value)
            return
        self.assign(node, node.id, value)

    def _unpacked(self, node: ast.Tuple, value: Value) -> None:
        """Set several: all right sides first, where a target changes what another one reads."""
        if isinstance(value.type, Array):
            count = self.known(node, value.type.shape[0])
            index = [
                ast.Subscript(ast.Name("", ast.Load()), ast.Constant(k), ast.Load()) for k in range(count)
            ]
            items = [self.place(one, value, value.type) for one in index]
        elif isinstance(value.type, Tuple):
            items = [self.item(value, k) for k in range(len(value.type.types))]
        else:
            raise self.refused(node, "unpacking a number", "assign one by one")
        if len(items) != len(node.elts):
            raise self.refused(node, f"{len(items)} values for {len(node.elts)} names", "name them all")
        if self._meet(node.elts, items):
            items = [one if one.number is not None or one.items else self.temporary(one) for one in items]
        for target, item in zip(node.elts, items, strict=True):
            self.target(target, item)

    def _meet(self, targets: list[ast.expr], items: list[Value]) -> bool:
        """Whether a target is read by a value that is set later."""
        for k, target in enumerate(targets):
            texts = " ".join(self.text(one) for one in items[k + 1 :])
            if isinstance(target, ast.Name):
                if re.search(rf"\b{self.name(target.id)}\b", texts):
                    return True
            elif "[" in texts:
                return True
        return False

    def _place(self, node: ast.Subscript | ast.Attribute) -> Value:
        """Return an element or view that is assigned to."""
        if isinstance(node, ast.Attribute):
            base = self.expression(node.value)
            return self.field(base, node.attr) if isinstance(base.type, RowType) else self.attribute(node)
        base = self.expression(node.value)
        if not isinstance(base.type, Array) or base.type.bits:
            raise self.refused(node, "setting an item of what is no array", "use an array")
        return self.place(node, base, base.type)

    def stored(self, node: ast.AST, place: Value, value: Value) -> None:
        """Set an element or all elements of a view."""
        if isinstance(place.type, Array):
            self.filled(node, place, value)
            return
        if not place.code.endswith("]") or not isinstance(place.type, Scalar):
            raise self.refused(node, "setting a field of a tuple", "make a new tuple")
        if place.number is not None:
            raise self.refused(node, "setting an entry that never changes", "take it from the settings")
        self.write(node, place)
        found = self.narrowed(node, value, place.type)
        self.emit(f"{place.code} = {found.code};")

    def updated(self, node: ast.AugAssign) -> None:
        """Update in place."""
        if isinstance(node.target, ast.Name):
            now = self.variable(ast.Name(node.target.id, ast.Load(), lineno=node.lineno))
            if isinstance(now.type, Array):
                self._each_updated(node, now)
                return
            value = self.expression(node.value)
            self.assign(node, node.target.id, self.combined(node, node.op, now, value))
            return
        assert isinstance(node.target, ast.Subscript | ast.Attribute)
        place = self._place(node.target)
        if isinstance(place.type, Array):
            self._each_updated(node, place)
            return
        before = len(self.lines)
        value = self.expression(node.value)
        if any(line.call for line in self.lines[before:]):
            calls, self.lines = self.lines[before:], self.lines[:before]
            old = self.temporary(place)
            self.lines += calls
        else:
            old = place
        self.stored(node, place, self.combined(node, node.op, old, value))

    def _each_updated(self, node: ast.AugAssign, view: Value) -> None:
        value = self.expression(node.value)
        if not isinstance(value.type, Array):
            value = self.temporary(value) if value.number is None else value
        self.write(node, view)
        assert isinstance(view.type, Array)
        kind = view.type

        def one(names: list[str]) -> None:
            left = Value(self.element(view, names), kind.element, root=view.root)
            right = value
            if isinstance(value.type, Array):
                right = Value(self.element(value, names), value.type.element)
            self.stored(node, left, self.combined(node, node.op, left, right))

        self.each(kind, node, one)

    # -- conditions and loops --------------------------------------------------------------------------

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
        self._bounded(node, turns)
        with self.block(f"for (int64_t {counter} = {start.code}; {counter} {sign} {stop.code}; {advance})"):
            self._loop_variable(node, name, counter, apart)
            self.body(node.body)

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
            column = Value("", Tuple(tuple, tuple(one.type for one in cells)), items=tuple(cells))
            columns.append(self.listed(node, column))
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
            with self.block(f"if ({turns} >= {limit.code})"):
                self.emit("*fault = -2;")
                self.emit("break;")
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

    # -- results ---------------------------------------------------------------------------------------

    def returned(self, node: ast.Return) -> None:
        """Return a value of the type of all results."""
        value = Value("", Nothing()) if node.value is None else self.expression(node.value)
        kind: Type | None = value.type if self.result is None else unified(self.result, value.type)
        if kind is None or isinstance(kind, RowType):
            raise self.refused(node, "results of two types", "return the same in all branches")
        self._check_alive(node, value)
        self.returns.append(value)
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

    parameters: tuple[str, ...] = ()
    """Names in C of the parameters."""

    def declare(self, kinds: tuple[Type, ...], counts: tuple[int | None, ...]) -> None:
        """Set the parameters; those whose number is known are none."""
        names = [one.arg for one in self.source.tree.args.args]
        self.parameters = tuple(self.name(one) for one in names)
        for k, (name, kind) in enumerate(zip(names, kinds, strict=True)):
            root = self.name(name) if isinstance(kind, Array | RowType) else ""
            self.variables[name] = Variable(kind, counts[k] if counts else None, root)

    def begin(self) -> None:
        """Forget the lines, not the types: another pass over the kernel."""
        super().begin()
        self.returns: list[Value] = []
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
