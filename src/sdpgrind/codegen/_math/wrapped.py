"""Text around foreign sources: a header that renames what they define, and a file for each to be compiled."""

import re
from typing import Any

from sdpgrind.codegen._math.sources import MathSources
from sdpgrind.codegen._translate.prototypes import declared
from sdpgrind.codegen._translate.runtime import GUARDS

_HEADER = """\
/*
 * {name}_math.h: elementary functions of {name}, from the sources in math/; see the licence there.
 * Their names get the prefix {name}_math_, so that they are those of {name} alone. Without fused
 * multiply-adds, which some of them ask for, they have the same bits everywhere.
 */
#ifndef {upper}_MATH_H
#define {upper}_MATH_H

#include <float.h>
#include <math.h>

{guards}

/* with half precision on board, which nothing here uses: doubles are doubles */
#if defined(FLT_EVAL_METHOD) && (FLT_EVAL_METHOD == 16)
#undef FLT_EVAL_METHOD
#define FLT_EVAL_METHOD 0
#endif

#undef __FP_FAST_FMA
#undef __FP_FAST_FMAF
#undef FP_FAST_FMA
#undef FP_FAST_FMAF
{marks}
{renames}

{prototypes}

#endif
"""


def math_files(sources: MathSources, name: str) -> dict[str, bytes]:
    """Return the files of elementary functions beside an export, the sources among them."""
    header = f"{name}_math.h"
    head = _HEADER.format(
        name=name, upper=name.upper(), guards=GUARDS,
        marks="".join(f"#ifndef {one}\n#define {one}\n#endif\n" for one in sources.undefined),
        renames="\n".join(f"#define {one} {outside(name)}{one}" for one in sources.names),
        prototypes="\n".join(declared(sources.names, outside(name))),
    )  # fmt: skip
    units = {_unit(name, one): f'#include "{header}"\n#include "math/{one}"\n' for one in sources.compiled}
    told = {one: text.encode("latin-1") for one, text in {header: head, **units}.items()}
    return told | {f"math/{one}": content for one, content in sources.files.items()}


def math_notes(sources: MathSources) -> dict[str, Any]:
    """Return what the manifest says of the functions: where they are defined, and their licence."""
    return {
        "math_functions": {one: f"math/{file}" for one, file in sources.functions.items()},
        "licences": [f"math/{one}" for one in sources.licences],
    }


def outside(name: str) -> str:
    """Return the prefix of elementary functions of an export."""
    return f"{name}_math_"


def _unit(name: str, source: str) -> str:
    return f"{outside(name)}{re.sub(r'[^A-Za-z0-9_]', '_', source.removesuffix('.c'))}.c"
