"""Names of units: symbols, capitals as controls write them, and words of English and German.

Examples
--------
>>> float(unit_named("Mikrometer").factor)
1e-06
>>> unit_named("SEC") == unit_named("seconds")
True
"""

import math
from collections.abc import Mapping
from fractions import Fraction
from typing import NamedTuple

Exponents = tuple[Fraction, ...]  # of length, time, mass, angle, money, current
_BITS_MAX = 4096  # of a factor; chosen: floats end at 1024


class Unit(NamedTuple):
    """Factor to SI units and exponents of a unit."""

    factor: Fraction
    exponents: Exponents

    def times(self, other: "Unit", sign: int = 1) -> "Unit":
        """Product with the unit `other`, or quotient (`sign` = -1)."""
        exponents = tuple(a + sign * b for a, b in zip(self.exponents, other.exponents, strict=True))
        return Unit(self.factor * other.factor**sign, exponents)

    def power(self, exponent: Fraction) -> "Unit":
        """Unit to a power."""
        size = max(self.factor.numerator.bit_length(), self.factor.denominator.bit_length())
        if abs(exponent) * size > _BITS_MAX:
            raise ValueError("its powers of powers are too great")
        return Unit(Fraction(self.factor**exponent), tuple(a * exponent for a in self.exponents))


def _unit(factor: str | Fraction, *exponents: int) -> Unit:
    return Unit(Fraction(factor), tuple(Fraction(e) for e in (*exponents, *[0] * (6 - len(exponents)))))


_TURN = Fraction(2 * math.pi)
_FOOT = Fraction("0.3048")
# derived: exponents of length, time, mass, angle
_FORCE, _ENERGY, _POWER, _PRESSURE = (1, -2, 1), (2, -2, 1), (2, -3, 1), (-1, -2, 1)
# derived: of length, time, mass, angle, money, current
_SPEED, _ANGLE, _ROTATION, _CURRENT = (1, -1), (0, 0, 0, 1), (0, -1, 0, 1), (0, 0, 0, 0, 0, 1)
_POUND = Fraction("4.4482216152605")  # N; source: 0.45359237 kg of 1959 times 9.80665 m/s^2
_KILOPOND = Fraction("9.80665")  # N; source: standard acceleration of gravity of 1901
_LENGTHS = {"m": "1", "cm": "0.01", "mm": "0.001", "nm": "1e-9"} | dict.fromkeys(("um", "µm", "μm"), "1e-6")
_INCHES = {"in": "0.0254", "thou": "0.0000254"} | dict.fromkeys(("uin", "µin", "μin"), "0.0000000254")
_SECONDS = dict.fromkeys(("s", "sec", "Sek"), "1") | dict.fromkeys(("ms", "msec"), "0.001") | {"ns": "1e-9"}
_MICROSECONDS = dict.fromkeys(("us", "µs", "μs", "usec"), "1e-6")
_KILOPONDS = dict.fromkeys(("kp", "kgf"), _KILOPOND)
_KILOWATTS = dict.fromkeys(("kW", "kw", "KW"), "1000")
_HORSES = {"hp": 550 * _FOOT * _POUND, "PS": 75 * _KILOPOND}
_ARCS = {"arcmin": _TURN / 21600, "arcsec": _TURN / 1296000}
_DEGREES = dict.fromkeys(("deg", "°", "Grad"), _TURN / 360) | _ARCS
_RADIANS = {"rad": "1", "mrad": "0.001"} | dict.fromkeys(("urad", "µrad", "μrad"), "1e-6")
_FEET_A_MINUTE = dict.fromkeys(("fpm", "sfm", "sfpm", "SFM", "SFPM"), _FOOT / 60)
_NAMED: tuple[tuple[Mapping[str, str | Fraction], tuple[int, ...]], ...] = (
    (_LENGTHS | _INCHES | {"ft": _FOOT}, (1,)),
    (_SECONDS | _MICROSECONDS | {"min": "60", "h": "3600", "day": "86400"}, (0, 1)),
    ({"kg": "1", "g": "0.001"}, (0, 0, 1)),
    ({"N": "1", "kN": "1000", "daN": "10", "lbf": _POUND, **_KILOPONDS}, _FORCE),
    ({"J": "1", "mJ": "0.001", "kJ": "1000", "Nm": "1"}, _ENERGY),
    ({"mW": "0.001", "W": "1", **_KILOWATTS, **_HORSES}, _POWER),
    ({"Pa": "1", "kPa": "1000", "MPa": "1e6", "GPa": "1e9"}, _PRESSURE),
    ({"rev": _TURN, "U": _TURN, "gon": _TURN / 400, **_RADIANS, **_DEGREES}, _ANGLE),
    (dict.fromkeys(("cc", "ccm"), "1e-6"), (3,)),
    ({"ipm": Fraction("0.0254") / 60, **_FEET_A_MINUTE}, _SPEED),
    ({"Hz": _TURN, "kHz": 1000 * _TURN, "rpm": _TURN / 60}, _ROTATION),
    ({"$": "1", "ct": "0.01"}, (0, 0, 0, 0, 1)),
    ({"A": "1", "mA": "0.001"}, _CURRENT),
    ({"1": "1", "%": "0.01"}, ()),
)
_SYMBOLS = {name: _unit(factor, *powers) for named, powers in _NAMED for name, factor in named.items()}
_CAPITALS = {
    **{one.upper(): one for one in ("mm", "cm", "um", "in", "ipm", "s", "min", "sec", "deg", "rev", "rpm")},
    **{"KN": "kN", "HZ": "Hz"},
}
"""Symbols as controls write them; not "M" (a measured one, too) and "NM" (of three meanings)."""
_PREFIXES = {
    "mega": "1e6", "kilo": "1000", "zenti": "0.01", "centi": "0.01", "milli": "0.001", "mikro": "1e-6",
    "micro": "1e-6", "nano": "1e-9",
}  # fmt: skip
_PREFIXED = {
    "meter": "m", "metre": "m", "second": "s", "sekunde": "s", "newton": "N", "joule": "J", "watt": "W",
    "ampere": "A", "amp": "A", "gram": "g", "gramm": "g", "radian": "rad", "pascal": "Pa", "hertz": "Hz",
    "inch": "in",
}  # fmt: skip
_WORDS = {
    "micron": "um", "mikron": "um", "zoll": "in", "foot": "ft", "feet": "ft", "sec": "s", "min": "min",
    "minute": "min", "hr": "h", "hour": "h", "stunde": "h", "day": "day", "degree": "deg", "gradian": "gon",
    "revolution": "rev", "umdrehung": "rev", "percent": "%", "prozent": "%",
}  # fmt: skip
_PLURALS = ("", "s", "es", "n", "en", "e")
_AMBIGUOUS = {
    **dict.fromkeys(("mil", "mils"), '"thou" (0.001 in) or "mm"'),
    **dict.fromkeys(("HP", "CV"), '"hp" (550 ft lbf/s) or "PS" (75 m kp/s)'),
    **dict.fromkeys(("lb", "lbs"), '"lbf" (a force), or a mass in "kg"'),
    **dict.fromkeys(("grad", "grads"), '"deg" (1/360 of a turn) or "gon" (1/400)'),
}
"""Words that people write for more than one unit, and what to write instead."""


def unit_named(name: str) -> Unit:
    """Return the unit of a symbol or a word; raise ValueError for what is none or may be several."""
    if name in _AMBIGUOUS:
        raise ValueError(f"{name!r} may mean several units; write {_AMBIGUOUS[name]}")
    unit = _SYMBOLS.get(_CAPITALS.get(name, name)) or _in_words(name.lower())
    if unit is None:
        raise ValueError(f"{name!r} is no unit known here" if name else "a unit is missing at the end")
    return unit


def _in_words(word: str) -> Unit | None:
    """Unit of a word with or without a prefix, one or many."""
    endings = [word.removesuffix(plural) for plural in _PLURALS if word.endswith(plural)]
    for one in endings:
        if one in _WORDS:
            return _SYMBOLS[_WORDS[one]]
        prefix = next((p for p in _PREFIXES if one.startswith(p)), "")
        symbol = _PREFIXED.get(one[len(prefix) :])
        if symbol is not None:
            return _SYMBOLS[symbol].times(_unit(_PREFIXES.get(prefix, "1")))
    return None
