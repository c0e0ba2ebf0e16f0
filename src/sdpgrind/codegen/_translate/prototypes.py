"""Functions of math.h: their arguments, and declarations of them under names of an export."""

from collections.abc import Iterable

_SIGNATURES = {
    "double @(double x)": "acos asin atan cos sin tan acosh asinh atanh cosh sinh tanh exp exp2 expm1 log"
    " log10 log1p log2 logb cbrt fabs sqrt erf erfc lgamma tgamma ceil floor nearbyint rint round trunc",
    "double @(double x, double y)": "atan2 hypot pow fmod remainder copysign nextafter fdim fmax fmin",
    "double @(double x, double y, double z)": "fma",
    "double @(double x, double y, int *n)": "remquo",
    "double @(double x, int n)": "ldexp scalbn",
    "double @(double x, long n)": "scalbln",
    "double @(double x, int *n)": "frexp",
    "double @(double x, double *n)": "modf",
    "int @(double x)": "ilogb",
    "long @(double x)": "lrint lround",
    "long long @(double x)": "llrint llround",
}
"""Source: ISO/IEC 9899:1999, 7.12, but for nan and nexttoward."""
_OF = {name: signature for signature, names in _SIGNATURES.items() for name in names.split()}
NAMES = frozenset(_OF)


def declared(names: Iterable[str], prefix: str) -> list[str]:
    """Return declarations of those names that math.h declares, under a prefix."""
    return [f"{text.replace('@', prefix + one)};" for one in names if (text := _declaration(one))]


def arguments(name: str) -> str:
    """Return the names of the arguments, a letter each, of a function of one double or two."""
    return "xy" if "double y" in _OF[name] else "x"


def _declaration(name: str) -> str:
    """Return the declaration with "@" for the name; "" where math.h has none."""
    if name in _OF:
        return _OF[name]
    kind = {"f": "float", "l": "long double"}.get(name[-1], "")
    return _OF.get(name[:-1], "").replace("double", kind) if kind else ""
