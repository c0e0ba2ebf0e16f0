"""All functions that an export reaches: one for each kernel and each tuple of argument types."""

import ast
import hashlib
import inspect
import re
from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any, TypeAlias

import numpy as np

from sdpgrind.base.compiling.compiled import Kernel
from sdpgrind.codegen._translate.body import CLine, merged, without_unused
from sdpgrind.codegen._translate.prototypes import declared
from sdpgrind.codegen._translate.reads import Reads
from sdpgrind.codegen._translate.refusals import KernelSource, check_options, source_of
from sdpgrind.codegen._translate.runtime import AT_MACRO, TAKEN, guarded, helper_text, helpers_in_order
from sdpgrind.codegen._translate.statements import Statements
from sdpgrind.codegen._translate.tables import ConstantTable
from sdpgrind.codegen._translate.types import (
    FLOAT64,
    INT64,
    Array,
    Nothing,
    RowType,
    Scalar,
    Tuple,
    Type,
    dense,
    same_result,
    size_of,
    to_numba,
    unfixed,
)
from sdpgrind.codegen._translate.values import Value, gathered, known, literal
from sdpgrind.codegen._translate.views import SizeUnknownError

_PASSES = 12  # chosen: passes over one kernel; types only widen, so two or three suffice
_FEW = 64  # chosen: entries of a table whose numbers are written where they are read
_FRAME = 96  # chosen: bytes of stack of a call beside its variables and arguments
_ENTRY = 8  # derived: bytes of a pointer

Numbers: TypeAlias = tuple[int | float | bool | None, ...]
"""Those of the arguments of a kernel that are known."""


@dataclass(frozen=True)
class Function:
    """A function in C, and what its callers must know of it."""

    name: str
    signature: str
    kernel: Kernel
    source: KernelSource
    parameters: tuple[str, ...]
    types: tuple[Type, ...]
    result: Type
    written: frozenset[str]
    faults: bool
    text: str
    bounds: tuple[dict[str, Any], ...]
    stack: int
    view: tuple[int, int] | None
    """Of a kernel that only returns a view: the parameter and the place; such a one is no function in C."""
    number: int | float | bool | None = None
    """Result of a kernel that only returns what is known; such a one is no function in C either."""
    least: int | float | None = None
    """Least of its results, where all are known."""
    refuses: bool = True
    """Whether a result below 0 is to be reached."""

    @property
    def record(self) -> dict[str, Any]:
        """Return what the manifest tells."""
        digest = hashlib.sha256(self.source.text.encode()).hexdigest()
        where = {
            "kernel": self.kernel.py_func.__qualname__,
            "file": self.source.file,
            "line": self.source.first,
        }
        told = {"written_out": True} if self.source.written_out else {}
        return {"name": self.name, **where, **told, "sha256": digest}


@dataclass
class CProgram:
    """Functions, structures and tables under one prefix."""

    prefix: str
    functions: dict[Any, Function] = field(default_factory=dict)
    structures: dict[Tuple, str] = field(default_factory=dict)
    tables: dict[str, ConstantTable] = field(default_factory=dict)
    comments: dict[str, str] = field(default_factory=dict)
    helpers: set[str] = field(default_factory=set)
    checked: bool = False
    outside: str = ""
    """Prefix of elementary functions that are not those of math.h."""
    written_out: Mapping[Kernel, str] = field(default_factory=dict)
    """Text that is translated in place of a kernel."""
    _underway: list[Any] = field(default_factory=list)
    _arrays: dict[Any, Value] = field(default_factory=dict)
    _sources: dict[Kernel, KernelSource] = field(default_factory=dict)

    # -- names -----------------------------------------------------------------------------------------

    def helper(self, name: str) -> str:
        """Return the name of a helper, which is then defined."""
        self.helpers.add(name)
        return f"{self.prefix}_{name}"

    def macro(self, name: str) -> str:
        """Return the name of the check of indices."""
        self.checked = True
        return f"{self.prefix}_{name}"

    def spelled(self, kind: Type) -> str:
        """Return the name of a type in C."""
        if isinstance(kind, Scalar):
            return kind.c
        if isinstance(kind, Array | RowType):
            return "const double *" if isinstance(kind, RowType) else f"const {kind.element.c} *"
        if isinstance(kind, Nothing):
            return "void"
        kind = unfixed(kind)
        assert isinstance(kind, Tuple)
        if kind not in self.structures:
            for one in kind.types:
                self.spelled(one)
            self.structures[kind] = self._free(kind.made_by.__name__)
        return self.structures[kind]

    def _free(self, wanted: str) -> str:
        """Return a name that no type, table or function has: C knows but one of each."""
        name, count = f"{self.prefix}_{wanted.strip('_')}", 1
        names = {*self.structures.values(), *self.tables, *(one.name for one in self.functions.values())}
        names |= {f"{self.prefix}_{one}" for one in TAKEN}
        while (name if count == 1 else f"{name}_{count}") in names:
            count += 1
        return name if count == 1 else f"{name}_{count}"

    # -- constants -------------------------------------------------------------------------------------

    def constant(self, thing: Any, name: str, library: Any = None) -> Value:
        """Return a constant of the library or of the law, or a thing that exists while translating.

        `library`: the same numbers as the library's step has them, where these are wider.
        """
        if isinstance(thing, np.generic) and not isinstance(thing, np.void):
            thing = thing.item()
        if isinstance(thing, bool | int | float):
            return literal(thing, name if not name.startswith(("inf", "nan", "pi")) else "")
        if isinstance(thing, tuple):
            fields = getattr(thing, "_fields", range(len(thing)))
            named = (
                f"{name}_{inner}" if isinstance(one, tuple | np.ndarray) else ""
                for one, inner in zip(thing, fields, strict=True)
            )
            items = tuple(map(self.constant, thing, named, thing if library is None else library))
            return gathered(type(thing), items)
        if isinstance(thing, np.ndarray):
            return self.table(thing, name or "table", thing if library is None else library)
        return known(thing)

    def table(self, array: Any, name: str, library: Any = None) -> Value:
        """Return an array of constants, which is written once; `library` as of `constant`."""
        array = np.ascontiguousarray(array)
        rounded = library is not None and library.dtype.kind != array.dtype.kind
        key = (array.dtype.str, array.shape, array.tobytes(), rounded)
        if key not in self._arrays:
            about = self.comments.get(name, name.strip("_").replace("_", " "))
            made = ConstantTable(self._free(name), array, about, rounded)
            self.tables[made.name] = made
            numbers = made.numbers if made.known else []
            few = numbers if array.size <= _FEW else []
            every = repr(numbers[0]) if len(set(map(repr, numbers))) == 1 and numbers[0] == numbers[0] else ""
            kind = Array(
                made.element, array.shape, dense(array.shape), fixed=tuple(enumerate(few)), every=every
            )
            self._arrays[key] = Value(made.name, kind)
        return self._arrays[key]

    # -- functions -------------------------------------------------------------------------------------

    def function(
        self, kernel: Kernel, values: list[Value], at: tuple[KernelSource, ast.AST] | None
    ) -> Function:
        """Return the function of a kernel for arguments of these types."""
        kinds, tested = tuple(one.type for one in values), self._tested(kernel, values)
        known = tuple(
            one if two.count is None else two.count for one, two in zip(tested, values, strict=True)
        )
        for numbers in (tested, known):
            if _key(kernel, kinds, numbers) in self.functions:
                return self.functions[_key(kernel, kinds, numbers)]
        found: Function | None = None
        try:
            found, numbers = self._translated(kernel, kinds, tested, at), tested
        except SizeUnknownError:
            if known == tested:
                raise
        if found is None or (known != tested and isinstance(found.result, Array) and found.view is None):
            found, numbers = self._translated(kernel, kinds, known, at), known
        self.functions[_key(kernel, kinds, numbers)] = self._once(found)
        return self.functions[_key(kernel, kinds, numbers)]

    def _once(self, function: Function) -> Function:
        """Return a function; under the name of an earlier one that differs in nothing but its name."""
        for one in self.functions.values():
            if one.kernel is function.kernel and one.text == renamed(function.text, function.name, one.name):
                return replace(function, name=one.name, text=one.text, signature=one.signature)
        return function

    @property
    def written(self) -> list[Function]:
        """Functions, each once."""
        return list({one.name: one for one in self.functions.values()}.values())

    def _tested(self, kernel: Kernel, values: list[Value]) -> Numbers:
        """Return the known doubles and truths of values that a kernel compares: it is translated for them."""
        tested = self._source(kernel).tested
        pairs = zip(values, inspect.signature(kernel.py_func).parameters, strict=True)
        return tuple(
            one.number if name in tested and one.count is None and one.number == one.number else None
            for one, name in pairs
        )

    def _source(self, kernel: Kernel) -> KernelSource:
        if kernel not in self._sources:
            self._sources[kernel] = source_of(kernel, self.written_out.get(kernel, ""))
        return self._sources[kernel]

    def _translated(self, kernel: Kernel, kinds: tuple[Type, ...], numbers: Numbers, at: Any) -> Function:
        if kernel in self._underway and at is not None:
            raise at[0].refused(at[1], f"the recursion of {kernel.py_func.__name__}", "write a loop")
        self._underway.append(kernel)
        try:
            source = self._source(kernel)
            check_options(source, kernel)
            body = Statements(self, kernel, source)
            body.declare(kinds, numbers)
            result = kernel.result_type(tuple(to_numba(one) for one in kinds))
            self._settle(body)
            if wider := wider_result(body.result, result):  # of a branch that this law leaves out
                body.result = wider
                self._settle(body)
            found = self._finished(body, kinds, numbers)
        finally:
            self._underway.pop()
        if not same_result(found.result, result):
            raise AssertionError(f"{found.name}: {found.result}, and numba has {result}")
        return found

    def _settle(self, body: Statements) -> None:
        """Pass over a kernel until no type changes."""
        for _ in range(_PASSES):
            body.begin()
            body.body(body.source.tree.body)
            if not body.changed:
                return
        raise AssertionError(f"{body.kernel.py_func.__name__}: types still widen after {_PASSES} passes")

    def _finished(self, body: Statements, kinds: tuple[Type, ...], numbers: Numbers) -> Function:
        name = self._free(body.kernel.py_func.__name__)
        lines = without_unused(merged([*body.tops(), *body.lines]))
        faults = any("fault" in line.text for line in lines)
        result = body.result or Nothing()
        signature = body.signature(name, kinds, result, faults)
        text = "\n".join([body.comment(), signature, "{", *body.unused(lines), *map(shown, lines), "}"])
        callees = [
            one for one in self.functions.values() if any(f"{one.name}(" in line.text for line in lines)
        ]
        handed = sum(map(size_of, kinds)) + _ENTRY * faults
        stack = body.bytes + handed + _FRAME + max((one.stack for one in callees), default=0)
        return Function(
            name, signature, body.kernel, body.source, body.parameters, kinds, result,
            frozenset(body.written) & frozenset(body.parameters), faults, text, tuple(body.bounds), stack,
            body.view(lines), body.number() if not (faults or body.written) else None, body.least(),
            body.refuses,
        )  # fmt: skip

    def drop_unreached(self, text: str) -> None:
        """Forget functions, helpers and tables that are reached neither from a text nor from one another."""
        while True:
            words = set(re.findall(r"\w+", "\n".join([text, *(one.text for one in self.functions.values())])))
            calls = Counter(re.findall(r"(\w+)\(", "\n".join([text, *map(_inner, self.functions.values())])))
            left = {key: one for key, one in self.functions.items() if one.view or calls[one.name]}
            if len(left) == len(self.functions):
                break
            self.functions = left
        self.helpers = {one for one in self.helpers if f"{self.prefix}_{one}" in words}
        self.tables = {name: one for name, one in self.tables.items() if name in words}

    def read(self, text: str) -> list[ConstantTable]:
        """Return the tables that functions, and a text that calls them, read."""
        functions = {one.name: (one.signature, _inner(one)) for one in self.written}
        structures = {name: self._fields(kind) for kind, name in self.structures.items()}
        names = Reads(functions, structures).names(text)
        return [one for name, one in self.tables.items() if name in names]

    def _fields(self, kind: Tuple) -> tuple[tuple[str, str], ...]:
        """Return names of fields, each with the structure that it is."""
        inner = (self.spelled(one) if isinstance(one, Tuple) else "" for one in kind.types)
        return tuple(zip(kind.fields, inner, strict=True))

    @property
    def table_bytes(self) -> int:
        """Bytes of the tables that are written."""
        return sum(int(one.array.nbytes) for one in self.tables.values())

    # -- text ------------------------------------------------------------------------------------------

    def definitions(self) -> str:
        """Return structures, tables, helpers and functions, each before it is used."""
        prefix = f"{self.prefix}_"
        parts = [self._structure(kind, name) for kind, name in self.structures.items()]
        parts += [one.text for one in self.tables.values()]
        parts += [AT_MACRO.replace("@", prefix)] if self.checked else []
        if self.outside and (names := guarded(self.helpers)):
            parts.append("\n".join(declared(names, self.outside)))
        parts += [helper_text(name, prefix, self.outside) for name in helpers_in_order(self.helpers)]
        functions = [one for one in self.written if one.view is None]
        parts.append("\n".join(f"{one.signature};" for one in functions))
        return "\n\n".join([*parts, *(one.text for one in functions)])

    def _structure(self, kind: Tuple, name: str) -> str:
        fields = []
        for field_name, one in zip(kind.fields, kind.types, strict=True):
            spelled = self.spelled(one)
            fields.append(f"    {spelled}{'' if spelled.endswith('*') else ' '}{field_name};")
        return "\n".join(["typedef struct {", *fields, f"}} {name};"])


def _key(kernel: Kernel, kinds: tuple[Type, ...], numbers: Numbers) -> tuple[Kernel, str, str]:
    """Return what tells functions of a kernel apart: as text 0.0 is not -0.0, nor 1 True."""
    return kernel, repr(kinds), repr(numbers)


def _inner(function: Function) -> str:
    """Return the text of a function behind its head."""
    return function.text.partition("\n{\n")[2]


def renamed(text: str, name: str, new: str) -> str:
    """Return the text of a function under another name."""
    return re.sub(rf"\b{re.escape(name)}\(", f"{new}(", text)


def shown(line: CLine) -> str:
    """Return the text of a line, indented."""
    return "    " * line.depth + line.text


def wider_result(found: Type | None, result: Any) -> Scalar | None:
    """Return numba's type of a result where it is a wider number than the one found."""
    if not isinstance(found, Scalar):
        return None
    return next((one for one in (INT64, FLOAT64) if one.rank > found.rank and same_result(one, result)), None)
