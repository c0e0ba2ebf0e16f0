"""Texts of units and quantities in users' files: ``"mm³/s"``, ``"7 in"``, ``"300 rpm"``.

Factors are exact fractions of SI units: ``"150 mm"`` is 150.0 to the last bit.

Examples
--------
>>> factor("mm·min-1", "mm/s") * 600
10.0
>>> near("W")
('mW', 'kW', 'PS', 'hp')
"""

import re
from fractions import Fraction
from typing import Any

from sdpgrind.base import checks
from sdpgrind.base.unit_names import Unit, unit_named

_LENGTH_MAX = 80  # characters of a quantity or a unit; chosen: the longest of ours has 20
_DIGITS_MAX = 40  # on each side of the decimal sign; chosen: a float has 17
_EXPONENT_MAX = 400  # of 10; chosen: floats end at 308
_POWER_MAX = 12  # of a unit, and denominator of a power; chosen: those of grinding are below 5
_NESTED_MAX = 8  # parentheses; chosen: one is usual
_USUAL = tuple(
    (  # noqa: SIM905, a list of words is longer
        "nm um mm cm m in us ms s min um/s mm/s mm/min m/min m/s in/min in/s mm/s^2 m/s^2 N daN kN kp lbf mW"
        " W kW PS hp rad deg rad/s deg/s 1/min Hz J/mm^3 mm^3/s mm^3/min cm^3/min mm^2/s mm^3/(mm*min) mA A"
        " N*mm N*m"
    ).split()
)
"""Units that files of machines and gauges are written in, for messages."""
_TURNS = unit_named("rpm")
_PER_MINUTE = Unit(Fraction(1, 60), unit_named("s").power(Fraction(-1)).exponents)
_RAISED = str.maketrans("⁰¹²³⁴⁵⁶⁷⁸⁹⁺⁻", "0123456789+-")
_SIGNS = str.maketrans({"·": "*", "⋅": "*", "∙": "*", "×": "*", "−": "-"})
_TOKEN = re.compile(r"\s*(?:([A-Za-zµμ]+)\.?|([$%°()^*/·]|-?\d+(?:\.\d+)?))")
"""A name, with the point of its abbreviation or between factors, a sign, or a number."""
_EXPONENT = re.compile(r"-?\d{1,3}(?:\.\d{1,3}|/0*[1-9]\d?)?")
_WHOLE_MAX = 2**53  # derived: floats hold all whole numbers up to it
_NUMBER = re.compile(r"\s*([+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?)\s*(.*?)\s*$", re.DOTALL)


def quantity(name: str, value: Any, unit: str) -> float:
    """Return `value`, a number in `unit` or a text with its own unit, as a float in `unit`."""
    if not isinstance(value, str):
        if isinstance(value, int) and abs(value) > _WHOLE_MAX:
            raise checks.refuse(name, "a whole number of at most 2^53, or a float", value, unit)
        return checks.number(name, value, unit)
    if len(value) > _LENGTH_MAX:
        raise ValueError(f"{name} must have at most {_LENGTH_MAX} characters; got {len(value)}")
    split = _NUMBER.match(value)
    if split is None:
        example = f"3 {unit or '%'}"
        raise ValueError(
            f'{name} must be a number ({unit or "1"}) or a text such as "{example}"; got {value!r}'
        )
    number, written = split.groups()
    _refuse_long(name, number, value)
    if not written:
        return checks.number(name, float(number), unit)
    try:
        given, wanted = parse(written), parse(unit or "1")
    except ValueError as error:
        why = "a decimal sign is a point" if re.match(r",\d", written) else str(error)
        raise ValueError(f"{name} must have a unit like {unit or '1'}; got {value!r}: {why}") from None
    if given.exponents != wanted.exponents:
        raise ValueError(f"{name} must have a unit like {unit or '1 (none)'}; got {value!r}")
    try:
        return checks.number(name, float(Fraction(number) * given.factor / wanted.factor), unit)
    except OverflowError:
        raise ValueError(
            f"{name} must be a number that a float holds ({unit or '1'}); got {value!r}"
        ) from None


def bare(value: Any) -> bool:
    """Whether `value` is a number, or a text of one, without a unit."""
    split = _NUMBER.match(value) if isinstance(value, str) else None
    return not isinstance(value, str) or (split is not None and not split[2])


def _refuse_long(name: str, number: str, value: str) -> None:
    """Refuse a number before `Fraction` sees it: 1e99999999 would take it for ever."""
    mantissa, _, exponent = number.lower().partition("e")
    if max(map(len, mantissa.lstrip("+-").split("."))) > _DIGITS_MAX:
        raise ValueError(
            f"{name} must have at most {_DIGITS_MAX} digits before and after the point; got {value!r}"
        )
    if abs(int(exponent or 0)) > _EXPONENT_MAX:
        raise ValueError(f"{name} must have an exponent within +-{_EXPONENT_MAX}; got {value!r}")


def factor(written: str, unit: str) -> float:
    """Return the factor from the unit text `written` to `unit`, "" or "1": none.

    1/min of a rotation is a revolution a minute. The message of a ValueError begins with the rule.
    """
    wanted = parse(unit or "1")
    try:
        given = parse(written)
    except ValueError as error:
        raise ValueError(f"{_alike(unit)}; got {written!r}: {error}") from None
    if given == _PER_MINUTE and wanted.exponents == _TURNS.exponents:
        given = _TURNS
    if given.exponents != wanted.exponents:
        raise ValueError(f"{_alike(unit)}; got {written!r}")
    try:
        return float(given.factor / wanted.factor)
    except OverflowError:
        raise ValueError(f"{_alike(unit)}; got {written!r}") from None


def near(unit: str) -> tuple[str, ...]:
    """Return the other usual units of the kind of `unit`."""
    wanted = parse(unit or "1")
    kind = {wanted.exponents} | ({_PER_MINUTE.exponents} if wanted.exponents == _TURNS.exponents else set())
    return tuple(name for name in _USUAL if name != unit and parse(name).exponents in kind)


def _alike(unit: str) -> str:
    others = near(unit)
    return f"have a unit like {unit or '1 (none)'}" + (f" ({', '.join(others)})" if others else "")


def parse(text: str) -> Unit:
    """Read a unit: names, products (space, ``*``), quotients, powers, parentheses."""
    if len(text) > _LENGTH_MAX:
        raise ValueError(f"a unit has at most {_LENGTH_MAX} characters")
    tokens = _tokens(text)
    if tokens.count("(") > _NESTED_MAX:
        raise ValueError(f"a unit has at most {_NESTED_MAX} parentheses")
    try:
        unit = _product(tokens)
    except OverflowError:
        raise ValueError("its powers of powers are too great") from None
    if tokens:
        raise ValueError(f"{tokens[0]!r} is out of place")
    return unit


def _tokens(text: str) -> list[str]:
    text = _plain(text)
    tokens, end = [], 0
    while end < len(text.rstrip()):
        found = _TOKEN.match(text, end)
        if found is None:
            raise ValueError(f"{text[end:].strip()!r} is no unit")
        tokens.append(found[1] or found[2])
        end = found.end()
    return tokens


def _plain(text: str) -> str:
    """A unit with ``^`` before its exponents and ``*`` between factors: ``mm·s⁻¹`` and ``min-1``, too."""
    text = re.sub(r"[⁺⁻]?[⁰¹²³⁴⁵⁶⁷⁸⁹]+", lambda found: "^" + found[0].translate(_RAISED), text)
    return re.sub(r"(?<=[A-Za-zµμ])([+-]?\d+)", r"^\1", text.translate(_SIGNS))


def _product(tokens: list[str]) -> Unit:
    unit = _power(tokens)
    while tokens and tokens[0] != ")":
        sign = -1 if tokens[0] == "/" else 1
        if tokens[0] in "*/·":
            tokens.pop(0)
        unit = unit.times(_power(tokens), sign)
    return unit


def _power(tokens: list[str]) -> Unit:
    unit = _atom(tokens)
    if tokens[:1] == ["^"]:
        tokens.pop(0)
        return unit.power(_exponent(tokens))
    return unit


def _atom(tokens: list[str]) -> Unit:
    token = tokens.pop(0) if tokens else ""
    if token == "(":
        unit = _product(tokens)
        if not tokens or tokens.pop(0) != ")":
            raise ValueError("a parenthesis is not closed")
        return unit
    return unit_named(token)


def _exponent(tokens: list[str]) -> Fraction:
    """A number, or a fraction in parentheses."""
    taken = [tokens.pop(0)] if tokens else []
    if taken == ["("]:
        end = tokens.index(")") if ")" in tokens else len(tokens)
        taken, tokens[: end + 1] = tokens[:end], []
    written = "".join(taken)
    if not _EXPONENT.fullmatch(written):  # "1e99999999" would take `Fraction` for ever
        raise ValueError(f"{written!r} is no exponent")
    exponent = Fraction(written)
    if abs(exponent) > _POWER_MAX or exponent.denominator > _POWER_MAX:
        raise ValueError(f"{written!r} is no exponent within +-{_POWER_MAX} in twelfths or coarser")
    return exponent
