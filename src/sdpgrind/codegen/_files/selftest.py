"""Self-test of an export: a program in C that compares with what the library answered."""

from math import copysign, isfinite, isnan

import numpy as np

from sdpgrind.base.checks import Floats
from sdpgrind.codegen._files.vector_kernels import BASIS
from sdpgrind.codegen._files.vectors import SEED, STEPS, Vectors, spread_of
from sdpgrind.codegen._recipe import Recipe
from sdpgrind.codegen._translate.runtime import BITS_OF, FLAGS, GUARDS, HASHED

THIS_C = "this C where it was exported"
_TEXT = """\
/*
 * {name}_selftest.c: {rows} vectors and {blocks} digests of {steps} steps, against {reference}.
 * cc {flags} {name}.c {units}{name}_selftest.c -lm -o t && ./t
 * Returns 0 where every bit of outputs, status and state is that of {reference}, and of constant tables
 * that of the export, else 1.
 */
#include "{name}.h"

#include <float.h>
#include <inttypes.h>
#include <math.h>
#include <stdio.h>
#include <string.h>

{guards}

#define ROWS {rows}
#define INPUTS {inputs}
#define OUTPUTS {outputs}
#define BLOCKS {blocks}
#define STEPS {steps}

/* whether the state is reset, inputs, outputs, status */
static const double vectors[ROWS][INPUTS + OUTPUTS + 2] = {{
{vectors}
}};
static const uint64_t vectors_digest = UINT64_C({digest});
static const uint64_t digests[BLOCKS] = {{
{digests}
}};
static const double spread[INPUTS] = {{{spread}}};
static const int missing[INPUTS] = {{{missing}}};

{bits_of}

{hashed}

static uint64_t after(uint64_t total, const {name}_state *state, const double *out, int32_t status)
{{
    int k;
    total = hashed(total, (uint64_t)((int64_t)status + 4));
    for (k = 0; k < OUTPUTS; k++) {{
        total = hashed(total, bits_of(out[k]));
    }}
    for (k = 0; k < {upper}_STATE_SIZE; k++) {{
        total = hashed(total, bits_of(state->s[k]));
    }}
    return total;
}}

static int32_t stepped({name}_state *state, const double *row, double *out)
{{
    {name}_input in = {{0}};
    {name}_output found = {{0}};
    int32_t status;
{given}
    status = {name}_step(state, &in, &found);
{taken}
    return status;
}}

static uint64_t next(uint64_t *seed)
{{
    *seed ^= *seed << 13;
    *seed ^= *seed >> 7;
    *seed ^= *seed << 17;
    return *seed;
}}

static double varied(uint64_t word, double value, double half, int may_miss)
{{
    unsigned what = (unsigned)(word & 63U);
    volatile double share = (double)(word >> 11) * 0x1p-53;
    if ((what == 0U) && (may_miss != 0)) {{
        return (double)NAN;
    }}
    if (what == 2U) {{
        return value;
    }}
    share = share - 0.5;
    if (what == 1U) {{
        half *= 50.0;
    }}
    share = 2.0 * half * share;
    return value + share;
}}

/* Digest of the next steps of the long run: the vectors' inputs, varied. */
typedef struct {{
    {name}_state state;
    uint64_t seed;
    int64_t row;
    double scale;
    int wild;
}} long_run;

static uint64_t block(long_run *run)
{{
    uint64_t total = UINT64_C({basis});
    int k;
    int j;
    for (k = 0; k < STEPS; k++) {{
        uint64_t word = next(&run->seed);
        unsigned what = (run->wild != 0) ? (unsigned)(word & 255U) : 255U;
        double in[INPUTS];
        double out[OUTPUTS];
        int32_t status;
        if (what == 1U) {{
            run->row += (int64_t)((word >> 8) & 15U);
        }} else if ((what == 3U) || (what == 0U)) {{
            run->row = (int64_t)((word >> 8) % ROWS);
        }} else if (what != 2U) {{
            run->row += 1;
        }}
        run->row %= ROWS;
        if ((vectors[run->row][0] != 0.0) || (what == 0U)) {{
            run->scale = (double)((word >> 40) & 3U) * 0.5;
            run->wild = (int)((word >> 44) & 1U);
            {name}_reset(&run->state);
        }}
        for (j = 0; j < INPUTS; j++) {{
            in[j] = varied(next(&run->seed), vectors[run->row][1 + j], run->scale * spread[j], missing[j]);
        }}
        status = stepped(&run->state, in, out);
        total = after(total, &run->state, out, status);
    }}
    return total;
}}

static int environment(void)
{{
    volatile double tiny = DBL_MIN;
    volatile double one = 1.0;
    volatile double step = DBL_EPSILON;
    int wrong = 0;
    if ((tiny / 2.0) == 0.0) {{
        printf("{name}: small numbers are flushed to zero (something was linked with -ffast-math)\\n");
        wrong = 1;
    }}
    if (((one + (step / 4.0)) != 1.0) || ((-one - (step / 4.0)) != -1.0) || ((one + (step * 0.75)) == 1.0)) {{
        printf("{name}: the processor does not round to nearest\\n");
        wrong = 1;
    }}
    return wrong;
}}

static int rows_differ(double *largest)
{{
    {name}_state state;
    uint64_t total = UINT64_C({basis});
    int wrong = 0;
    int k;
    int j;
    for (k = 0; k < ROWS; k++) {{
        const double *row = vectors[k];
        double out[OUTPUTS];
        int32_t status;
        int same;
        if (row[0] != 0.0) {{
            {name}_reset(&state);
        }}
        status = stepped(&state, &row[1], out);
        same = ((double)status == row[1 + INPUTS + OUTPUTS]) ? 1 : 0;
        for (j = 0; j < OUTPUTS; j++) {{
            double wanted = row[1 + INPUTS + j];
            if (bits_of(out[j]) != bits_of(wanted)) {{
                same = 0;
                if (fabs(out[j] - wanted) > *largest) {{
                    *largest = fabs(out[j] - wanted);
                }}
            }}
        }}
        total = after(total, &state, out, status);
        wrong += (same != 0) ? 0 : 1;
    }}
    if ((wrong == 0) && (total != vectors_digest)) {{
        printf("{name}: the state differs\\n");
        wrong = 1;
    }}
    return wrong;
}}

static int tables_differ(void)
{{
    int wrong = ({name}_digest() != {upper}_DIGEST) ? 1 : 0;
    if (wrong != 0) {{
        printf("{name}: a number of a constant table is not the one that was exported\\n");
    }}
    return wrong;
}}

int main(void)
{{
    static long_run run;
    double largest = 0.0;
    int wrong = environment() + tables_differ();
    int rows = rows_differ(&largest);
    int blocks = 0;
    int k;
    {name}_reset(&run.state);
    run.seed = UINT64_C({seed});
    run.row = -1;
    for (k = 0; k < BLOCKS; k++) {{
        if (block(&run) != digests[k]) {{
            blocks++;
        }}
    }}
    printf("{name}: %d of %d vectors and ", rows, ROWS);
    printf("%d of %d digests of %d steps differ", blocks, BLOCKS, STEPS);
    if (rows > 0) {{
        printf(", outputs by up to %.3g", largest);
    }}
    printf("\\n");
    return ((wrong + rows + blocks) > 0) ? 1 : 0;
}}
"""


def _units(recipe: Recipe, name: str, folder: bool) -> str:
    """Return the sources that are compiled with it, beside its own."""
    program = "" if recipe.program is None else f"{name}_program.c "
    return program + (f"{name}_math_*.c " if folder else "")


def selftest(recipe: Recipe, name: str, vectors: Vectors, folder: bool = False) -> str:
    """Return the text of the self-test; `folder`: answers are those of the C itself."""
    digests = [f"UINT64_C({one:#018x})" for one in vectors.digests]
    return _TEXT.format(
        reference=THIS_C if folder else "the library", units=_units(recipe, name, folder),
        name=name, upper=name.upper(), guards=GUARDS, hashed=HASHED, bits_of=BITS_OF,
        rows=len(vectors.rows), inputs=len(recipe.inputs),
        outputs=len(recipe.outputs), blocks=len(digests), steps=STEPS, seed=SEED, basis=BASIS,
        digest=f"{vectors.digest:#018x}", flags=" -O2 ".join(FLAGS),
        vectors=_vectors(vectors), digests=_columns(digests, 4), spread=_listed(spread_of(recipe)),
        missing=", ".join(str(int(not one)) for one in recipe.finite),
        given="\n".join(f"    in.{one} = row[{k}];" for k, one in enumerate(recipe.inputs)),
        taken="\n".join(f"    out[{k}] = found.{one};" for k, one in enumerate(recipe.outputs)),
    )  # fmt: skip


def _vectors(vectors: Vectors) -> str:
    answers = vectors.answers
    rows = np.column_stack((vectors.resets, vectors.rows, answers.outputs, answers.codes)).tolist()
    return ",\n".join("    {" + ", ".join(map(hexadecimal, row)) + "}" for row in rows)


def _columns(texts: list[str], count: int) -> str:
    return ",\n".join("    " + ", ".join(texts[k : k + count]) for k in range(0, len(texts), count))


def _listed(numbers: Floats) -> str:
    return ", ".join(map(hexadecimal, numbers))


def hexadecimal(number: float) -> str:
    """Return a double with all its digits."""
    if isfinite(number):
        return "0.0" if number == 0.0 and copysign(1.0, number) > 0.0 else float(number).hex()
    return "(double)NAN" if isnan(number) else "(double)INFINITY" if number > 0.0 else "-(double)INFINITY"
