"""What is known while a kernel is translated: its variables, its lines so far, and temporaries."""

import ast
import re
from abc import ABC, abstractmethod
from collections import Counter
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from typing import Any, Protocol

from sdpgrind.codegen._translate.refusals import KernelSource
from sdpgrind.codegen._translate.types import (
    FLOAT32,
    Array,
    Known,
    Nothing,
    RowType,
    Tuple,
    Type,
    number_of,
    size_of,
    unfixed,
    unified,
)
from sdpgrind.codegen._translate.values import LOWEST, PRIMARY, Value, cast, identical, literal, within


class ProgramLike(Protocol):
    """What a body asks of the program that it belongs to."""

    def helper(self, name: str) -> str:
        """Return the name of a helper, which is then defined."""

    def macro(self, name: str) -> str:
        """Return the name of the check of indices."""

    def spelled(self, kind: Type) -> str:
        """Return the name of a type in C."""

    def constant(self, thing: Any, name: str) -> Value:
        """Return a constant, or a thing that exists while translating only."""

    def function(self, kernel: Any, values: list[Value], at: Any) -> Any:
        """Return the function of a kernel for arguments of these types."""


_WORDS = """
auto break case char const continue default do double else enum extern float for goto if inline int long
register restrict return short signed sizeof static struct switch typedef union unsigned void volatile
while bool true false fault acos asin atan atan2 cbrt ceil copysign cos cosh erf exp exp2 expm1 fabs
floor fma fmax fmin fmod frexp gamma hypot index j0 j1 jn ldexp lgamma log log10 log1p log2 logb modf
nan pow remainder rint round scalb sin sinh sqrt tan tanh tgamma time trunc y0 y1 yn memcpy memset signal
div abs labs
"""
RESERVED = frozenset(_WORDS.split())
"""Names that C, its headers or the translation take."""


@dataclass(frozen=True)
class CLine:
    """A line of C; `target`: the variable that it sets; `call`: what must stay where nobody reads that."""

    text: str
    depth: int
    target: str = ""
    call: str = ""


@dataclass
class Variable:
    """A variable: its type, its number if it is always the same, the root of what it points to."""

    type: Type
    number: int | float | bool | None = None
    root: str = ""


class Body(ABC):
    """State of the translation of one kernel for one tuple of argument types."""

    def __init__(self, program: ProgramLike, kernel: Any, source: KernelSource) -> None:
        self.program, self.kernel, self.source = program, kernel, source
        self.variables: dict[str, Variable] = {}
        self.result: Type | None = None
        self.written: set[str] = set()
        self.changed = False
        self.begin()

    def begin(self) -> None:
        """Forget the lines, not the types: another pass over the kernel."""
        self.lines: list[CLine] = []
        self.depth, self.temporaries, self.changed = 1, 0, False
        self.declared: set[str] = set()
        self.on_top: dict[str, Type] = {}
        self.bounds: list[dict[str, str | int]] = []
        self.bytes = 0

    @abstractmethod
    def expression(self, node: ast.expr) -> Value:
        """Return the value of an expression; emit what must be done before it."""

    def refused(self, node: ast.AST, construct: str, remedy: str) -> Exception:
        """Return the error for a construct."""
        return self.source.refused(node, construct, remedy)

    # -- lines -----------------------------------------------------------------------------------------

    def emit(self, text: str, target: str = "", call: str = "") -> None:
        """Append a line."""
        self.lines.append(CLine(text, self.depth, target, call))

    @contextmanager
    def block(self, opening: str, closing: str = "}") -> Iterator[None]:
        """Emit lines between braces."""
        self.emit(opening + " {")
        self.depth += 1
        yield
        self.depth -= 1
        self.emit(closing)

    @contextmanager
    def apart(self) -> Iterator[list[CLine]]:
        """Collect lines apart, one level deeper."""
        before, self.lines = self.lines, []
        collected: list[CLine] = []
        self.depth += 1
        yield collected
        self.depth -= 1
        collected += self.lines
        self.lines = before

    # -- variables -------------------------------------------------------------------------------------

    def name(self, name: str) -> str:
        """Return the name in C of a variable."""
        return name + "_" if name in RESERVED else name

    def declaration(self, name: str, kind: Type, root: str = "") -> str:
        """Return the declaration of a variable; pointers to what nobody writes to are constant."""
        if isinstance(kind, Array | RowType):
            element = kind.element.c if isinstance(kind, Array) else "double"
            return f"{'' if root in self.written else 'const '}{element} *{name}"
        return f"{self.program.spelled(kind)} {name}"

    def fresh(self) -> str:
        """Return the name of a new temporary."""
        self.temporaries += 1
        return f"t{self.temporaries}"

    def temporary(self, value: Value, call: str = "") -> Value:
        """Put a value into a temporary."""
        name = self.fresh()
        self.bytes += size_of(value.type)
        declared = self.declaration(name, value.type, value.root)
        constant = "" if isinstance(value.type, Array | RowType) else "const "
        self.emit(f"{constant}{declared} = {self.text(value)};", name, call)
        return Value(name, value.type, root=root_of(value))

    def text(self, value: Value) -> str:
        """Return the text of a value of any type."""
        return text_of(self.program, value)

    def read(self, node: ast.Name, name: str) -> Value:
        """Return the value of a variable."""
        found = self.variables[name]
        if found.number is not None:
            return literal(found.number)
        return Value(self.name(name), found.type, root=found.root)

    def assign(self, node: ast.AST, name: str, value: Value) -> None:
        """Set a variable; a number that is always the same needs none."""
        found = self.joined(node, name, value)
        if found.number is None and name in self.source.read:
            self._set(name, found, self.converted(node, value, found.type))

    def joined(self, node: ast.AST, name: str, value: Value) -> Variable:
        """Return the variable, which takes a value of this type, too."""
        if isinstance(value.type, Known | Nothing):
            raise self.refused(node, f"{name} = a module, a function or nothing", "use it by its own name")
        found, root = self.variables.get(name), root_of(value)
        if found is None:
            found = self.variables[name] = Variable(value.type, value.number, root)
            self.changed = True
        self._join(node, name, found, value)
        return found

    def _join(self, node: ast.AST, name: str, found: Variable, value: Value) -> None:
        kind = unified(found.type, value.type)
        if kind is None:
            raise self.refused(
                node, f"one variable, {name}, of two types", "give the second a name of its own"
            )
        number = found.number if identical(value.number, found.number) else None
        if kind != found.type or (number is None) != (found.number is None):
            found.type, found.number, self.changed = kind, number, True
        if root_of(value) != found.root:
            raise self.refused(node, f"{name}, a view of two arrays,", "use two names")

    def _set(self, name: str, variable: Variable, value: Value) -> None:
        text = f"{self.name(name)} = {self.text(value)};"
        if name in self.declared:
            if self.text(value) != self.name(name):
                self.emit(text, self.name(name))
            return
        self.declared.add(name)
        self.bytes += size_of(variable.type)
        if self.depth == 1:
            declared = self.declaration(self.name(name), variable.type, variable.root)
            self.emit(f"{declared} = {self.text(value)};", self.name(name))
        else:
            self.on_top[name] = variable.type
            self.emit(text, self.name(name))

    # -- order of evaluation ---------------------------------------------------------------------------

    def converted(self, node: ast.AST, value: Value, kind: Type) -> Value:
        """Return a value as another type."""
        if isinstance(kind, Tuple) and value.items is None and unfixed(value.type) == unfixed(kind):
            return replace(value, type=kind)
        if isinstance(kind, Tuple) and value.type != kind:
            items = [self.converted(node, self.item(value, k), one) for k, one in enumerate(kind.types)]
            return Value("", kind, items=tuple(items))
        found = cast(value, kind)
        if found is None:
            if value.type == FLOAT32:
                raise self.refused(node, "arithmetic of four-byte floats", "write np.float64(...)")
            raise self.refused(node, "a conversion that loses digits", "write int(...) or float(...)")
        return found

    def item(self, value: Value, k: int) -> Value:
        """Return an item of a tuple."""
        if value.items is not None:
            return value.items[k]
        assert isinstance(value.type, Tuple)
        kind, told = value.type.types[k], dict(value.type.fixed).get(k)
        if told is not None:
            return literal(number_of(kind, told), value.type.named(k))
        return Value(f"{value.code}.{value.type.fields[k]}", kind)

    def operands(self, nodes: list[ast.expr]) -> list[Value]:
        """Return values in the order of Python: what is read before a call that may change it is kept."""
        found: list[Value] = []
        for node in nodes:
            before = len(self.lines)
            value = self.expression(node)
            calls, self.lines = self.lines[before:], self.lines[:before]
            if any(line.call for line in calls):
                found = [self.temporary(one) if one.reads else one for one in found]
            self.lines += calls
            found.append(value)
        return found

    def chosen(
        self, test: Value, kind: Type, branches: list[tuple[list[CLine], Value]], node: ast.AST
    ) -> Value:
        """Return one of two values of which one must not be evaluated."""
        name = self.fresh()
        self.emit(f"{self.program.spelled(kind)} {name};", name)
        for opening, (lines, value) in zip((f"if ({test.code}) {{", "} else {"), branches, strict=True):
            self.emit(opening)
            self.lines += lines
            self.depth += 1
            self.emit(f"{name} = {self.text(self.converted(node, value, kind))};")
            self.depth -= 1
        self.emit("}")
        return Value(name, kind)

    def as_truth(self, node: ast.AST, value: Value) -> Value:
        """Return a number as a truth."""
        if not isinstance(value.type, Array | RowType | Tuple | Known | Nothing):
            if value.type.c == "bool":
                return value
            if value.number is not None:
                return literal(bool(value.number))
            zero = "0.0" if value.type.c == "double" else "0"
            return Value(f"{within(value, PRIMARY)} != {zero}", literal(True).type, LOWEST)
        raise self.refused(node, "the truth of what is no number", "compare it")


def text_of(program: ProgramLike, value: Value) -> str:
    """Return the text of a value of any type: an address, a structure, a number."""
    if value.items is not None:
        return f"({program.spelled(value.type)}){_braced(program, value)}"
    if isinstance(value.type, Array | RowType):
        place = place_of(value)
        return value.code if place == "0" else f"&{value.code}[{place}]"
    return value.code


def _braced(program: ProgramLike, value: Value) -> str:
    if value.items is None:
        return text_of(program, value)
    return "{" + ", ".join(_braced(program, one) for one in value.items) + "}"


def root_of(value: Value) -> str:
    """Return the variable through which an array or record is reached; "" for numbers."""
    return value.root if isinstance(value.type, Array | RowType) else ""


def place_of(value: Value) -> str:
    """Return the place behind a pointer: terms, and a constant with its name."""
    told = f" /* {value.note} */" if value.note else ""
    if not value.terms:
        return f"{value.at}{told}"
    terms = " + ".join(value.terms)
    return f"{value.at}{told} + {terms}" if value.at or told else terms


def moved(value: Value, at: int, terms: tuple[str, ...] = (), note: str = "") -> Value:
    """Return a view that begins later."""
    noted = note or value.note
    return replace(value, at=value.at + at, terms=value.terms + terms, note=noted)


_SET = re.compile(r"const \S.*?\b(t\d+) = (.+);")


def merged(lines: list[CLine]) -> list[CLine]:
    """Put a call whose temporary the next line alone takes into that line."""
    found: list[CLine] = []
    uses = Counter(re.findall(r"\bt\d+\b", " ".join(line.text for line in lines)))
    for line in lines:
        before = _SET.fullmatch(found[-1].text) if found and found[-1].call else None
        head, _, taken = line.text.rpartition(" = ") if " = " in line.text else ("", "", line.text[7:])
        if before and uses[before[1]] == 2 and taken == f"{before[1]};" and head.count("[") < 2:
            text = line.text.removesuffix(f"{before[1]};") + f"{before[2]};"
            found[-1] = replace(line, text=text, call=found[-1].call)
        else:
            found.append(line)
    return found


def without_unused(lines: list[CLine]) -> list[CLine]:
    """Drop lines that set variables which nothing reads; calls stay."""
    while True:
        words = [set(re.findall(r"[A-Za-z_]\w*", line.text)) for line in lines]
        read: set[str] = set()
        for line, named in zip(lines, words, strict=True):
            read |= named - {line.target}
        unused = [line.target != "" and line.target not in read for line in lines]
        if not any(unused):
            return lines
        lines = [
            replace(line, text=line.call, target="") if drop else line
            for line, drop in zip(lines, unused, strict=True)
            if line.call or not drop
        ]
