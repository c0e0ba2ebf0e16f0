"""Digest of the constant tables of an export: its value here, and the functions that compute it in C."""

from collections.abc import Iterable, Sequence

import numpy as np

from sdpgrind.codegen._files.vector_kernels import BASIS, hashed_words
from sdpgrind.codegen._translate.runtime import BITS_OF, HASHED
from sdpgrind.codegen._translate.tables import ConstantTable

_CELLS = """\
static uint64_t @hashed_{kind}(uint64_t total, const volatile {kind} *cells, int64_t count)
{{
    for (int64_t k = 0; k < count; k++) {{
        total = @hashed(total, {word});
    }}
    return total;
}}"""
"""Read through volatile: a compiler that computed the digest by itself would not see the target's memory."""
_WORDS = {"double": "@bits_of(cells[k])", "float": "@bits_of((double)cells[k])"}
_WHOLE = "(uint64_t)(int64_t)cells[k]"
_DIGEST = """\
uint64_t @digest(void)
{{
{lines}
    return total;
}}"""


def digest_of(tables: Iterable[ConstantTable]) -> int:
    """Return the digest of all numbers, table by table."""
    total = BASIS
    for one in tables:
        total = int(hashed_words(np.uint64(total), one.words))
    return total


def digest_text(name: str, tables: Sequence[ConstantTable]) -> str:
    """Return the public function that computes it in C, behind those that it calls."""
    kinds = sorted({one.element.c for one in tables})
    parts = [HASHED.replace("hashed", "@hashed")] if kinds else []
    parts += [BITS_OF.replace("bits_of", "@bits_of")] if set(kinds) & set(_WORDS) else []
    parts += [_CELLS.format(kind=one, word=_WORDS.get(one, _WHOLE)) for one in kinds]
    lines = [f"uint64_t total = UINT64_C({BASIS});"]
    lines += [f"total = @hashed_{one.element.c}(total, {one.name}, {one.array.size});" for one in tables]
    parts.append(_DIGEST.format(lines="\n".join(f"    {one}" for one in lines)))
    return "\n\n".join(parts).replace("@", f"{name}_")
