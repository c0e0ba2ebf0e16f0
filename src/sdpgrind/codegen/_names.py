"""Names that an export may not have, since C, its headers, the systems that compile it or C++ take them."""

import keyword
import re

from sdpgrind.base import checks
from sdpgrind.codegen._translate.body import RESERVED

LONGEST = 63  # source: ISO/IEC 9899:1999, 5.2.4.1: characters of a name that tell it from others

_CPP = """
alignas alignof and and_eq asm bitand bitor catch char8_t char16_t char32_t class co_await co_return co_yield
compl concept const_cast consteval constexpr constinit decltype delete dynamic_cast explicit export friend
mutable namespace new noexcept not not_eq nullptr operator or or_eq private protected public
reinterpret_cast requires static_assert static_cast template this thread_local throw try typeid typename
using virtual wchar_t xor xor_eq
"""
"""Source: ISO/IEC 14882:2020, 5.11: the header is for C++, too."""

_MACROS = """
NAN INFINITY HUGE_VAL HUGE_VALF HUGE_VALL NULL EOF I TRUE FALSE BUFSIZ RAND_MAX errno assert complex imaginary
stdin stdout stderr setjmp offsetof va_arg linux unix i386 mips sparc
FP_CONTRACT FP_FAST_FMA FP_INFINITE FP_NAN FP_NORMAL FP_SUBNORMAL FP_ZERO FP_ILOGB0 FP_ILOGBNAN
math_errhandling M_E M_LOG2E M_LOG10E M_LN2 M_LN10 M_PI M_PI_2 M_PI_4 M_1_PI M_2_PI M_2_SQRTPI M_SQRT2
M_SQRT1_2 ROWS INPUTS OUTPUTS BLOCKS STEPS
"""
"""Of the headers; linux, unix and the like: of compilers in GNU mode; ROWS to STEPS: of the self-test."""

_FAMILIES = re.compile(
    r"(DBL|FLT|LDBL|FE)_[A-Z0-9_]+|FLT_EVAL_METHOD|MATH_ERR(NO|EXCEPT)"
    r"|U?INT(_LEAST|_FAST)?\d+_(MIN|MAX|C)|U?INT(MAX|PTR)_(MIN|MAX|C)"
    r"|(S?CHAR|SHRT|INT|LONG|LLONG)_(BIT|MIN|MAX)|U(CHAR|SHRT|INT|LONG|LLONG)_MAX"
    r"|(SIZE|PTRDIFF|WCHAR|WINT|SIG_ATOMIC)_(MIN|MAX)|(PRI|SCN)[diouxX](LEAST|FAST)?(8|16|32|64|MAX|PTR)"
    r"|u?int(_least|_fast)?\d+_t|u?int(max|ptr)_t|size_t|ptrdiff_t|float_t|double_t"
)
"""Macros and types of float.h, limits.h, stdint.h, inttypes.h, fenv.h and math.h."""

_HEADERS = """
assert complex ctype errno fenv float inttypes iso646 limits locale math setjmp signal stdarg stdbool stddef
stdint stdio stdlib string tgmath time wchar wctype
"""
HEADERS = frozenset(_HEADERS.split())
"""Headers of C; source: ISO/IEC 9899:1999, 7.1.2."""

_MORE_HEADERS = "stdalign stdatomic stdnoreturn threads uchar memory new strings unistd malloc main"
"""Of C11, C++ and systems: a file NAME.h would be read in their place; main: of the self-test."""

_TAKEN = RESERVED | frozenset(_CPP.split()) | frozenset(_MACROS.split())
_NO_PREFIX = HEADERS | frozenset(_MORE_HEADERS.split())


def c_name(argument: str, name: str) -> str:
    """Return a name that C, C++ and Python allow; refuse others; as "name", of files, also a header's."""
    plain = re.fullmatch(r"[A-Za-z][A-Za-z0-9_]*", name)
    if not plain or keyword.iskeyword(name) or name in RESERVED:
        raise checks.refuse(argument, "an identifier of C and Python and no keyword", name)
    if len(name) > LONGEST:
        raise checks.refuse(argument, f"of at most {LONGEST} characters", len(name))
    # file systems that do not tell Math.h from math.h are common
    header = argument == "name" and name.lower() in _NO_PREFIX
    if header or name in _TAKEN or _FAMILIES.fullmatch(name):
        rule = "no name that standard headers, compilers or C++ take"
        raise checks.refuse(argument, rule, name)
    return name
