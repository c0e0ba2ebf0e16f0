"""Declared fields: unit, range and default, read by checks, texts, files and pictures.

A class with declared fields is a frozen dataclass; its checks run in the order of the fields, then its
`_check`.

Examples
--------
>>> @described()
... class Disk(Described):
...     radius: float = quantity("mm", above=0, usual=(5.0, 1000.0), typical=90)
...     speed: float = quantity("rad/s", at_least=0, default=0.0)
>>> Disk(85)
Disk(radius=85 mm)
>>> Disk(radius=0.085)
Traceback (most recent call last):
ValueError: radius must be in mm, some 90; units.m(...) for metres; got 0.085
"""

import dataclasses
import math
import sys
from collections.abc import Callable, Iterable, Iterator, Mapping
from types import NoneType
from typing import Any, ClassVar, NamedTuple, TypeVar, dataclass_transform, get_args

import numpy as np
import numpy.typing as npt

from sdpgrind.base import checks, notebook, units
from sdpgrind.base.arrays import ByValue, lasting
from sdpgrind.base.brief import brief
from sdpgrind.base.brief import text as written
from sdpgrind.base.frozen import Frozen
from sdpgrind.base.stored import stored

Made = TypeVar("Made")
Check = Callable[[str, Any], Any]
"""From field name and value to the value that is kept; raises ValueError or TypeError."""
_GREATEST = sys.float_info.max


class Spec(NamedTuple):
    """Declaration of a field."""

    kind: str  # number, count, text, flag, choice, part, law, array or custom
    check: Check
    unit: str = ""  # "1": a pure number; "": no quantity
    made_of: Any = None  # class of a part, classes of a law by name, words of a choice
    default: Any = dataclasses.MISSING
    required: bool = True
    optional: bool = False  # whether the field's annotation admits None

    def kept(self, name: str, value: Any) -> Any:
        """Return the value to keep: the default is not checked, nor None where the annotation admits it."""
        if value is self.default or (value is None and self.optional):
            return value
        if type(self.default) is float and type(value) in (int, float) and value == self.default:
            return self.default  # inf that a file held, or 0 for 0.0, is the default too
        return self.check(name, value)


def quantity(
    unit: str,
    *,
    above: float | None = None,
    at_least: float | None = None,
    below: float | None = None,
    at_most: float | None = None,
    hint: str = "",
    usual: tuple[float, float] | None = None,
    typical: float | None = None,
    **options: Any,
) -> Any:
    """Declare a number in `unit`; "1": a pure number, whose unit messages omit.

    Bounds on both sides make one rule, an interval; with a `hint` they make two, and the hint follows the
    nonzero bound. Outside `usual` the message names the `typical` value and the conversion that was
    forgotten. `options` (default, default_factory, repr, compare, hash, kw_only) are those of
    `dataclasses.field`, here and below.
    """
    if not unit:
        raise ValueError("unit must be that of the quantity, \"1\" for a pure number; got ''")
    if usual is not None and not typical:
        raise ValueError(
            f"typical must be a number other than 0 where a usual range is given ({unit}); got {typical!r}"
        )
    if type(options.get("default")) is int:
        options["default"] = float(options["default"])
    rules, written = _rules(above, at_least, below, at_most, hint), _written(unit)
    least, most = max(low for _, low, _ in rules), min(high for _, _, high in rules)
    if usual is not None:
        least, most = max(least, usual[0]), min(most, usual[1])

    def check(name: str, value: Any) -> float:
        if type(value) is float and least <= value <= most:
            return value
        number = checks.number(name, value, written)
        for rule, low, high in rules:
            if not low <= number <= high:
                raise checks.refuse(name, rule, number, written)
        if usual is not None and typical and not usual[0] <= number <= usual[1]:
            raise ValueError(another_unit(name, value, unit, usual, typical))
        return number

    return _field(Spec("number", check, unit), options)


def _rules(
    above: float | None, at_least: float | None, below: float | None, at_most: float | None, hint: str
) -> list[tuple[str, float, float]]:
    """Words of each rule, with the least and the greatest float that satisfy it."""
    least, opening = (at_least, "[") if above is None else (above, "(")
    most, closing = (at_most, "]") if below is None else (below, ")")
    low = -_GREATEST if least is None else least if above is None else math.nextafter(least, math.inf)
    high = _GREATEST if most is None else most if below is None else math.nextafter(most, -math.inf)
    if least is not None and most is not None and not hint:
        return [(f"in {opening}{least:g}, {most:g}{closing}", low, high)]
    rules = [("finite", -_GREATEST, _GREATEST)]
    if least is not None:
        rules.append((f"{'>=' if above is None else '>'} {least:g}{hint if least else ''}", low, _GREATEST))
    if most is not None:
        rules.append((f"{'<=' if below is None else '<'} {most:g}{hint}", -_GREATEST, high))
    return rules


def another_unit(name: str, value: Any, unit: str, usual: tuple[float, float], typical: float) -> str:
    """Message with the conversion that makes the value usual, and nearest to `typical`."""
    meant = forgotten(float(value), unit, usual, typical)
    return f"{name} must be in {unit}, some {typical:g}{meant}; got {checks.shown(value)}"


def forgotten(value: float, unit: str, usual: tuple[float, float], typical: float) -> str:
    """Return the end of a message: the conversion that makes a value usual, nearest to `typical`; or ""."""
    known = [
        (convert(value), f"; units.{convert.__name__}(...) for {words}")
        for convert, words in units.CONVERSIONS.get(unit, ())
    ]
    known += [
        (factor * value, f"; multiply by {factor:.10g} for {words}")
        for factor, words in units.FACTORS.get(unit, ())
    ]
    fitting = [
        (abs(math.log(abs(number / typical))), meant)
        for number, meant in known
        if number and usual[0] <= number <= usual[1]
    ]
    return min(fitting)[1] if fitting else ""


def count(at_least: int = 1, at_most: int = 2**31, **options: Any) -> Any:
    """Declare a whole number."""
    return _field(Spec("count", lambda name, value: checks.count(name, value, at_least, at_most)), options)


def flag(**options: Any) -> Any:
    """Declare True or False, numpy's included."""
    return _field(Spec("flag", _truth), options)


def _truth(name: str, value: Any) -> bool:
    return bool(value) if isinstance(value, np.bool_) else checks.kind(name, value, bool)


def text(**options: Any) -> Any:
    """Declare a text."""
    return _field(Spec("text", lambda name, value: checks.kind(name, value, str)), options)


def choice(*names: Any, **options: Any) -> Any:
    """Declare one of `names`."""
    return _field(
        Spec("choice", lambda name, value: checks.one_of(name, value, names), made_of=names), options
    )


def part(cls: type, hint: str = "", *, or_function: bool = False, **options: Any) -> Any:
    """Declare an object of a class, or `or_function` a function that draws one; `hint` ends the message."""

    def check(name: str, value: Any) -> Any:
        return value if or_function and callable(value) else checks.kind(name, value, cls, hint)

    return _field(Spec("part", check, made_of=cls), options)


def law(classes: Mapping[str, type], words: str, *methods: str, **options: Any) -> Any:
    """Declare an object with `methods`, described by `words`; `classes` are those that a file may name."""
    return _field(
        Spec("law", lambda name, value: checks.able(name, value, words, *methods), made_of=classes), options
    )


def array(unit: str, dtype: npt.DTypeLike = float, *, finite: bool = True, **options: Any) -> Any:
    """Declare numbers in `unit`, kept as a read-only copy; `finite=False` admits NaN."""
    written = _written(unit)

    def check(name: str, value: Any) -> npt.NDArray[Any]:
        return lasting(checks.finite_array(name, value, written) if finite else value, dtype)

    return _field(Spec("array", check, unit), options)


def custom(check: Check | None = None, unit: str = "", **options: Any) -> Any:
    """Declare a field with its own `check`, from name and value to the value that is kept."""
    return _field(Spec("custom", check or (lambda name, value: value), unit), options)


def _written(unit: str) -> str:
    """Unit as messages show it."""
    return "" if unit == "1" else unit


def _field(spec: Spec, options: dict[str, Any]) -> Any:
    return dataclasses.field(metadata={"spec": spec}, **options)


class Described(Frozen):
    """Base of frozen dataclasses with declared fields: checks, `replace`, and a repr with units."""

    __dataclass_fields__: ClassVar[dict[str, dataclasses.Field[Any]]]
    _declared: ClassVar[dict[str, Spec]] = {}

    def __post_init__(self) -> None:
        for name, spec in self._declared.items():
            value = getattr(self, name)
            kept = spec.kept(name, value)
            if kept is not value:
                object.__setattr__(self, name, kept)
        self._check()

    def _check(self) -> None:
        """Check rules between fields; a subclass overrides it."""

    def _field_units(self) -> dict[str, str]:
        """Units of the fields in tables; a subclass overrides those that depend on its values."""
        return units_of(type(self))

    def _refused(self, name: str, rule: str, value: object = None) -> ValueError:
        """Return the error of a field against a rule, with its unit; `value` instead of its own if given."""
        unit = _written(self._declared[name].unit)
        return checks.refuse(name, rule, getattr(self, name) if value is None else value, unit)

    def __repr__(self) -> str:
        return brief(self, units_of(type(self)))

    def _repr_html_(self) -> str:
        return notebook.table(type(self).__name__, ("field", "value", "unit"), _rows(self))


def _rows(thing: Described, within: str = "") -> Iterator[tuple[str, str, str]]:
    """Name, value and unit of each field, those of declared parts included."""
    known = thing._field_units()
    for field in dataclasses.fields(thing):
        value, name = getattr(thing, field.name), within + field.name
        if isinstance(value, Described):
            yield from _rows(value, f"{name}.")
        elif field.repr:
            yield name, written(value), _written(known.get(field.name, ""))


@dataclass_transform(
    frozen_default=True,
    field_specifiers=(quantity, count, flag, text, choice, part, law, array, custom, dataclasses.field),
)
def described(name: str | None = None, *, eq: bool = True) -> Callable[[type[Made]], type[Made]]:
    """Make a frozen dataclass of a `Described`, saved in files under `name`; None: never saved.

    A `ByValue` is compared by value; ``eq=False``: by identity.
    """

    def make(cls: type[Made]) -> type[Made]:
        known: Any = dataclasses.dataclass(frozen=True, repr=False, eq=eq and not issubclass(cls, ByValue))(
            cls
        )
        fields = [field for field in dataclasses.fields(known) if _is_declared(known, field)]
        known._declared = {field.name: _bound(field) for field in fields}
        return stored(name)(known) if name else known

    return make


def _is_declared(cls: type, field: dataclasses.Field[Any]) -> bool:
    if "spec" in field.metadata:
        return True
    if field.init and field.name in vars(cls).get("__annotations__", {}):
        how = "as quantity(unit), part(Class), ... or custom()"
        raise TypeError(f"{cls.__name__}.{field.name} must be declared {how}; it is a plain field")
    return False


def _bound(field: dataclasses.Field[Any]) -> Spec:
    """Return the declaration with default, and whether None is admitted."""
    spec: Spec = field.metadata["spec"]
    required = field.default is dataclasses.MISSING and field.default_factory is dataclasses.MISSING
    optional = "None" in field.type if isinstance(field.type, str) else NoneType in get_args(field.type)
    return spec._replace(default=field.default, required=required, optional=optional)


def specs(cls: type) -> Mapping[str, Spec]:
    """Return the declarations of a class by field; empty for other classes."""
    declared: Mapping[str, Spec] = getattr(cls, "_declared", {})
    return declared


def units_of(cls: type) -> dict[str, str]:
    """Return the unit of each field that is a quantity."""
    return {name: spec.unit for name, spec in specs(cls).items() if spec.unit}


def valued(thing: Any, names: Iterable[str]) -> dict[str, tuple[Any, str]]:
    """Return fields by name with their units."""
    known = specs(type(thing))
    return {name: (getattr(thing, name), known[name].unit if name in known else "") for name in names}


def trusted(cls: type[Made], **values: Any) -> Made:
    """Return an object of a described class from checked values, without checks."""
    made = object.__new__(cls)
    thing: Any = cls  # a type variable cannot declare itself a dataclass
    for field in dataclasses.fields(thing):
        if field.name not in values and field.default is not dataclasses.MISSING:
            values[field.name] = field.default
        elif field.name not in values and field.default_factory is not dataclasses.MISSING:
            values[field.name] = field.default_factory()
    made.__dict__.update(values)
    return made
