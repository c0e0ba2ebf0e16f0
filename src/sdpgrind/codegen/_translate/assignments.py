"""Assignments: to names, elements, fields and views, from one value or from a tuple; updates in place."""

import ast
import re

from sdpgrind.codegen._translate.expressions import Expressions
from sdpgrind.codegen._translate.types import (
    Array,
    RowType,
    Scalar,
    Tuple,
)
from sdpgrind.codegen._translate.values import PRIMARY, Value

_MAKERS = ("np.empty", "np.zeros", "np.ones")


class Assignments(Expressions):
    """Translation of assignments."""

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
