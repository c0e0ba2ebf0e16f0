"""Attributes and subscripts: items of tuples, fields of records, elements and views of arrays."""

import ast
import math
from dataclasses import dataclass, replace
from typing import Any

from sdpgrind.codegen._translate.body import Body, moved, place_of
from sdpgrind.codegen._translate.types import (
    FLOAT64,
    INT64,
    Array,
    Known,
    RowType,
    Scalar,
    Tuple,
    dense,
    number_of,
)
from sdpgrind.codegen._translate.values import (
    LOWEST,
    PRIMARY,
    PRODUCT,
    Value,
    cast,
    gathered,
    literal,
    within,
)


@dataclass(frozen=True)
class IndexedAxis:
    """What an index does with an axis: where it begins, and the extent that stays; -1: none."""

    at: int
    terms: tuple[str, ...]
    extent: int | None


class Views(Body):
    """Translation of attributes and subscripts."""

    def attribute(self, node: ast.Attribute) -> Value:
        """Return an attribute."""
        base = self.expression(node.value)
        kind = base.type
        if isinstance(kind, Known):
            return self.program.constant(getattr(kind.thing, node.attr), node.attr)
        if isinstance(kind, Tuple) and node.attr in kind.fields:
            return self.item(base, kind.fields.index(node.attr))
        if isinstance(kind, RowType) and node.attr in (kind.dtype.names or ()):
            found = self.field(base, node.attr)
            return found if found.number is None else literal(found.number, found.note)
        if isinstance(kind, Array):
            return self._of_array(node, base, kind)
        raise self.refused(node, f"the attribute {node.attr}", "use fields of records and tuples")

    def field(self, base: Value, name: str) -> Value:
        """Return a field of a record: a number, or a view."""
        assert isinstance(base.type, RowType)
        fields: Any = base.type.dtype.fields
        inner, offset = fields[name][:2]
        place = moved(base, offset // 8, note=name)
        if inner.shape:
            return replace(place, type=Array(FLOAT64, inner.shape, dense(inner.shape)))
        number = dict(base.type.fixed).get(offset // 8)
        return Value(f"{base.code}[{place_of(place)}]", FLOAT64, number=number, root=base.root, note=name)

    def _of_array(self, node: ast.Attribute, base: Value, kind: Array) -> Value:
        if node.attr == "size":
            return literal(self.size(node, kind))
        if node.attr == "shape":
            return gathered(tuple, self._extents(node, kind))
        if node.attr == "ndim":
            return literal(len(kind.shape))
        if node.attr == "T":
            turned = Array(kind.element, kind.shape[::-1], kind.strides[::-1], kind.bits)
            return replace(base, type=turned)
        raise self.refused(node, f"the attribute {node.attr} of an array", "write the loop")

    def _extents(self, node: ast.AST, kind: Array) -> tuple[Value, ...]:
        return tuple(literal(self.known(node, extent)) for extent in kind.shape)

    def known(self, node: ast.AST, extent: int | None) -> int:
        """Return an extent, which must be known."""
        if extent is None:
            raise self.unsized(node, "a size")
        return extent

    def unsized(self, node: ast.AST, what: str, remedy: str = "state it as a constant") -> Exception:
        """Return the error for a size that is not known without the numbers of the arguments."""
        return SizeUnknownError(str(self.refused(node, f"{what} that is no constant", remedy)))

    def size(self, node: ast.AST, kind: Array) -> int:
        """Return the number of elements."""
        total = 1
        for extent in kind.shape:
            total *= self.known(node, extent)
        return total

    def subscript(self, node: ast.Subscript) -> Value:
        """Return an item, an element, or a view."""
        base = self.expression(node.value)
        if isinstance(base.type, RowType):
            return base  # the one row of a view by names
        if isinstance(base.type, Tuple):
            return self._of_tuple(node, base)
        if not isinstance(base.type, Array):
            raise self.refused(node, "a subscript of what is neither array nor tuple", "use an array")
        place = self.place(node, base, base.type)
        if isinstance(place.type, Array) or not base.type.bits:
            return place if place.number is None else literal(place.number, place.note)
        return Value(f"{self.program.helper('bits')}({place.code})", INT64)

    def _of_tuple(self, node: ast.Subscript, base: Value) -> Value:
        assert isinstance(base.type, Tuple)
        index = self.expression(node.slice)
        if index.count is not None:
            return self.item(base, index.count % len(base.type.types))
        table = self.listed(node, base)
        return Value(f"{table.code}[{self.guarded(index, len(base.type.types))}]", table.type)

    def listed(self, node: ast.AST, base: Value) -> Value:
        """Put the items of a tuple of numbers into a local array; return its name and the items' type."""
        assert isinstance(base.type, Tuple)
        items = [self.item(base, k) for k in range(len(base.type.types))]
        kinds = [one.type for one in items if isinstance(one.type, Scalar)]
        if len(kinds) < len(items):
            raise self.refused(node, "a tuple of other things than numbers, indexed", "write out its items")
        kind = max(kinds, key=lambda one: one.rank)
        text = ", ".join(self.converted(node, one, kind).code for one in items)
        name = self.fresh()
        self.bytes += len(items) * kind.size
        self.emit(f"const {kind.c} {name}[{len(items)}] = {{{text}}};", name)
        return Value(name, kind)

    def place(self, node: ast.Subscript, base: Value, kind: Array) -> Value:
        """Return an element as text that can be assigned to, or a view."""
        indices = node.slice.elts if isinstance(node.slice, ast.Tuple) else [node.slice]
        if len(indices) > len(kind.shape):
            raise self.refused(node, "more indices than axes", "drop one")
        axes = [self.axis(one, extent) for one, extent in zip(indices, kind.shape, strict=False)]
        at, terms = 0, []
        for one, stride in zip(axes, kind.strides, strict=False):
            at += one.at * stride
            terms += [term if stride == 1 else f"{term} * {stride}" for term in one.terms]
        view = moved(base, at, tuple(terms), self._note(indices))
        kept = [k for k, one in enumerate(axes) if one.extent != -1] + list(range(len(axes), len(kind.shape)))
        if not kept:
            number = dict(kind.fixed).get(at) if not terms else None
            if number is None and kind.every:
                number = number_of(FLOAT64 if kind.element == FLOAT64 else INT64, kind.every)
            return Value(
                f"{base.code}[{place_of(view)}]", kind.element, number=number, root=base.root, note=view.note
            )
        shape = tuple(axes[k].extent if k < len(axes) else kind.shape[k] for k in kept)
        strides = tuple(kind.strides[k] for k in kept)
        size = math.prod(one or 1 for one in shape)
        whole = not terms and None not in shape and strides == dense(shape)
        fixed = tuple((k - at, one) for k, one in kind.fixed if whole and at <= k < at + size)
        if [one.extent for one in axes] == [-1] and axes[0].terms and None not in kind.shape and kind.dense:
            fixed = _same_in_rows(kind, size)
        return replace(view, type=replace(kind, shape=shape, strides=strides, fixed=fixed))

    def _note(self, indices: list[ast.expr]) -> str:
        """Return the name of a constant index, for the comment."""
        if len(indices) != 1 or not isinstance(indices[0], ast.Name | ast.Attribute):
            return ""
        found = self.expression(indices[0])
        return found.note

    def axis(self, node: ast.expr, extent: int | None) -> IndexedAxis:
        """Return what an index means; -1 counts from the end where it is a literal."""
        if not isinstance(node, ast.Slice):
            return self._one(self.expression(node), node, extent)
        if node.step is not None and self.expression(node.step).count != 1:
            raise self.refused(node, "a step in a slice", "write the loop")
        lower = None if node.lower is None else self.expression(node.lower)
        if lower is not None and lower.count is None:
            return self._computed(node, lower)
        first = 0 if lower is None else self._from_end(lower.count or 0, node, extent)
        upper = None if node.upper is None else self.expression(node.upper)
        if upper is None:
            return IndexedAxis(first, (), None if extent is None else max(extent - first, 0))
        if upper.count is None:
            raise self.unsized(node, "a slice of a size", "write the loop")
        last = self._from_end(upper.count, node, extent)
        return IndexedAxis(first, (), max((last if extent is None else min(last, extent)) - first, 0))

    def _one(self, index: Value, node: ast.expr, extent: int | None) -> IndexedAxis:
        if index.count is not None:
            return IndexedAxis(self._from_end(index.count, node, extent, behind=0), (), -1)
        return IndexedAxis(0, (self.guarded(self._whole(node, index), extent),), -1)

    def _whole(self, node: ast.AST, index: Value) -> Value:
        found = cast(index, INT64)
        if found is None:
            raise self.refused(node, "an index that is no whole number", "write int(...)")
        return found

    def guarded(self, index: Value, extent: int | None) -> str:
        """Return an index that the test build checks."""
        if extent is None:
            return within(index, PRODUCT)
        return f"{self.program.macro('AT')}({index.code}, {extent})"

    def _from_end(self, count: int, node: ast.AST, extent: int | None, behind: int = 1) -> int:
        """Return a place counted from the start; a slice may begin and end one `behind` the last."""
        at = count if count >= 0 else self.known(node, extent) + count
        if at < 0 or (extent is not None and at >= extent + behind):
            raise self.refused(node, f"the index {count} of {extent} elements", "stay within them")
        return at

    def _computed(self, node: ast.Slice, lower: Value) -> IndexedAxis:
        """Slice from a computed start: `[a : a + n]`, or one of unknown extent."""
        begin = within(self._whole(node, lower), PRODUCT)
        if node.upper is None:
            return IndexedAxis(0, (begin,), None)
        upper, start = node.upper, ast.dump(node.lower) if node.lower is not None else ""
        if isinstance(upper, ast.BinOp) and isinstance(upper.op, ast.Add) and ast.dump(upper.left) == start:
            length = self.expression(upper.right).count
            if length is not None:
                return IndexedAxis(0, (begin,), length)
        raise self.unsized(node, "a slice of a size", "write the loop")

    # -- loops over elements ---------------------------------------------------------------------------

    def each(self, kind: Array, node: ast.AST, body: Any) -> None:
        """Emit loops over all elements; `body` gets the indices."""
        names = [self.fresh() for _ in kind.shape]
        for name, extent in zip(names, kind.shape, strict=True):
            self.emit(f"for (int64_t {name} = 0; {name} < {self.known(node, extent)}; {name}++) {{")
            self.depth += 1
        body(names)
        for _ in names:
            self.depth -= 1
            self.emit("}")

    def element(self, view: Value, names: list[str]) -> str:
        """Return the text of an element of a view."""
        assert isinstance(view.type, Array)
        terms = tuple(
            name if stride == 1 else f"{name} * {stride}"
            for name, stride in zip(
                names[len(names) - len(view.type.shape) :], view.type.strides, strict=True
            )
        )
        return f"{view.code}[{place_of(moved(view, 0, terms))}]"

    def filled(self, node: ast.AST, view: Value, value: Value) -> None:
        """Set all elements of a view to a number, or to those of another array."""
        assert isinstance(view.type, Array)
        self.write(node, view)
        if isinstance(value.type, Array) and value.root == view.root:
            raise self.refused(node, "a copy within one array", "write the loop in the order that is meant")
        if not isinstance(value.type, Array):
            value = self.narrowed(node, value, view.type.element)
            value = self.temporary(value) if value.reads or value.level == LOWEST else value
        self.each(
            view.type,
            node,
            lambda names: self.emit(
                f"{self.element(view, names)} = "
                f"{self.element(value, names) if isinstance(value.type, Array) else value.code};"
            ),
        )

    def narrowed(self, node: ast.AST, value: Value, kind: Scalar) -> Value:
        """Return a number as an element of an array: whole numbers take what they hold."""
        found = cast(value, kind) if isinstance(value.type, Scalar) else None
        if found is None and INT64.rank >= kind.rank > 0 and value.type == INT64:
            found = Value(f"({kind.c}){within(value, PRIMARY)}", kind, PRODUCT)
        if found is None:
            raise self.refused(
                node, "storing a value that the array does not hold", "write int(...) or float(...)"
            )
        return found

    def write(self, node: ast.AST, view: Value) -> None:
        """Note that a kernel writes through a variable."""
        if not view.root:
            raise self.refused(
                node, "writing to what is constant, or stands in a tuple", "hand it over by itself"
            )
        if view.root not in self.written:
            self.written.add(view.root)
            self.changed = True


class SizeUnknownError(ValueError):
    """A size that is not known without the numbers of the arguments."""


def _same_in_rows(kind: Array, size: int) -> tuple[tuple[int, float], ...]:
    """Return the elements of fixed numbers that are the same in every row of an array."""
    fixed = dict(kind.fixed)
    rows = [[fixed.get(row * size + k) for k in range(size)] for row in range(kind.shape[0] or 0)]
    columns = enumerate(zip(*rows, strict=True))
    return tuple((k, one[0]) for k, one in columns if one[0] is not None and len(set(map(repr, one))) == 1)
