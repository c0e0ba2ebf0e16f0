"""Functions in C that translated kernels call: guards around the C library, and operators of Python.

`@` stands for the prefix of the export.
"""

from collections.abc import Iterable

from sdpgrind.codegen._translate.prototypes import NAMES, arguments
from sdpgrind.codegen._translate.types import ELEMENTS

FLAGS = ("-std=c99", "-ffp-contract=off")
"""Of every build; `GUARDS` say the same in the text, for compilers that follow pragmas."""

GUARDS = """\
#if defined(__FAST_MATH__)
#error "compile without -ffast-math: it changes results"
#endif
#if defined(__FINITE_MATH_ONLY__) && __FINITE_MATH_ONLY__ > 0
#error "compile without -ffinite-math-only: NaN and infinity must be told from numbers"
#endif
#if defined(FLT_EVAL_METHOD) && (FLT_EVAL_METHOD != 0) && (FLT_EVAL_METHOD != 16)
#error "doubles are computed with more digits here (x87): use SSE2 (-mfpmath=sse -msse2)"
#endif
#if DBL_MANT_DIG != 53
#error "double must be that of IEEE 754 with 64 bits"
#endif
#if defined(__GNUC__) && !defined(__clang__)
#pragma GCC optimize ("fp-contract=off")
#else
#pragma STDC FP_CONTRACT OFF
#endif"""
"""Contraction into fused multiply-add, and more digits than a double has, change bits."""

_GUARD = """\
static double @{name}({parameters})
{{
    {declared}
    return {function}({arguments});
}}"""
HASHED = """/* FNV-1a of words of 64 bits, shifted: of two totals, or two words, come two totals */
static uint64_t hashed(uint64_t total, uint64_t word)
{
    total = (total ^ word) * UINT64_C(1099511628211);
    return total ^ (total >> 32);
}"""
BITS_OF = """/* bits of a double, the same of every NaN */
static uint64_t bits_of(double number)
{
    uint64_t found = UINT64_C(0x7FF8000000000000);
    if (isnan(number) == 0) { /* guard */
        (void)memcpy(&found, &number, sizeof found);
    }
    return found;
}"""
"""Digests in C, as the kernels `hashed_words` and `digest` have them."""
_OWN = {
    "min": """static double @min(double a, double b)
{
    return (b < a) ? b : a;
}""",
    "max": """static double @max(double a, double b)
{
    return (b > a) ? b : a;
}""",
    "min_int": """static int64_t @min_int(int64_t a, int64_t b)
{
    return (b < a) ? b : a;
}""",
    "max_int": """static int64_t @max_int(int64_t a, int64_t b)
{
    return (b > a) ? b : a;
}""",
    "abs": """static int64_t @abs(int64_t a)
{
    return (a < 0) ? -a : a;
}""",
    "square": """static double @square(double x)
{
    return x * x;
}""",
    "power": """/* x to a whole power by repeated squaring, from the lowest bit of the exponent */
static double @power(double x, int64_t exponent)
{
    double result = 1.0;
    while (exponent != 0) {
        if ((exponent & 1) != 0) {
            result *= x;
        }
        exponent >>= 1;
        x *= x;
    }
    return result;
}""",
    "quotient": """/* rounded down; by 0: 0 */
static int64_t @quotient(int64_t a, int64_t b)
{
    int64_t found = (b == 0) ? 0 : (a / b);
    if ((b != 0) && ((a % b) != 0) && ((a < 0) != (b < 0))) {
        found -= 1;
    }
    return found;
}""",
    "remainder": """/* with the sign of the divisor; by 0: 0 */
static int64_t @remainder(int64_t a, int64_t b)
{
    int64_t found = (b == 0) ? 0 : (a % b);
    if ((found != 0) && ((found < 0) != (b < 0))) {
        found += b;
    }
    return found;
}""",
    "quotient_by": """/* rounded down; by what is above 0 */
static int64_t @quotient_by(int64_t a, int64_t b)
{
    return (a / b) - (((a % b) < 0) ? 1 : 0);
}""",
    "remainder_by": """/* with the sign of the divisor, which is above 0 */
static int64_t @remainder_by(int64_t a, int64_t b)
{
    int64_t found = a % b;
    return (found < 0) ? (found + b) : found;
}""",
    "mod": """/* remainder with the sign of the divisor */
static double @mod(double a, double b)
{
    double found = @fmod(a, b);
    if (found != 0.0) {
        if ((b < 0.0) != (found < 0.0)) {
            found += b;
        }
    } else {
        found = copysign(0.0, b);
    }
    return found;
}""",
    "int": """/* towards 0; what is no number, or none of 64 bits, gives 0 and a fault */
static int64_t @int(double x, int32_t *fault)
{
    if ((x >= -9223372036854775808.0) && (x < 9223372036854775808.0)) { /* guard */
        return (int64_t)x;
    }
    *fault = -3;
    return 0;
}""",
    "bits": """/* a whole number that a table keeps as the bits of a double */
static int64_t @bits(double x)
{
    int64_t found;
    (void)memcpy(&found, &x, sizeof found);
    return found;
}""",
}
_NEEDS = {"mod": ("fmod",)}
_ORDER = ("fmod", *_OWN)
_HASHED = ("hashed", "bits_of", *(f"hashed_{one.c}" for one in ELEMENTS.values()))
_PUBLIC = ("AT", "outside", "input", "output", "state", "reset", "step", "digest", "solve")
TAKEN = frozenset({*_OWN, *NAMES, *_HASHED, *_PUBLIC})
"""Names behind the prefix that no kernel, record or table may have in C."""


def helper_text(name: str, prefix: str, outside: str = "") -> str:
    """Return the definition of a helper; `outside`: prefix of the function that a guard calls."""
    text = _OWN.get(name)
    if text is None:
        letters = arguments(name)
        text = _GUARD.format(
            name=name,
            function=f"{outside}{name}",
            parameters=", ".join(f"double {one}" for one in letters),
            declared="\n    ".join(f"volatile double v{one} = {one};" for one in letters),
            arguments=", ".join(f"v{one}" for one in letters),
        )
    return text.replace("@", prefix)


def guarded(names: Iterable[str]) -> list[str]:
    """Return those helpers that guard a call of an elementary function, with those that others call."""
    return [one for one in helpers_in_order(set(names)) if one not in _OWN]


def helpers_in_order(names: set[str]) -> list[str]:
    """Return helpers with those that they call, in an order in which they can be defined."""
    needed = set(names).union(*(_NEEDS.get(name, ()) for name in names))
    return sorted(needed, key=lambda name: (_ORDER.index(name) if name in _ORDER else -1, name))


AT_MACRO = """\
#ifdef SG_CHECK
/* test build: an index outside its array gives 0 and the status -3 */
static int32_t @outside = 0;
static int64_t @AT(int64_t index, int64_t extent)
{
    if ((index >= 0) && (index < extent)) {
        return index;
    }
    @outside = 1;
    return 0;
}
#else
#define @AT(index, extent) (index)
#endif"""
"""Check of indices, in the test build alone."""
