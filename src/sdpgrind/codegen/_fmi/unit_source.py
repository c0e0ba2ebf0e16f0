"""Source of an FMU: the functions of the standard around `reset` and `step` of an export."""

from importlib.resources import files

from sdpgrind.codegen._fmi.variables import first_flag, first_value, status_reference
from sdpgrind.codegen._recipe import Recipe
from sdpgrind.codegen._translate.values import double

_TOP = """\
/*
 * {name}_fmu.c: FMI 2.0 for co-simulation around {name}_reset and {name}_step.
 * Here alone memory is allocated: one block an instance, one a stored state.
 */
#include "{name}.h"

#include <math.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define UNIT_GUID "{guid}"
#define UNIT_FINGERPRINT {upper}_FINGERPRINT
#define UNIT_RESET {name}_reset
#define UNIT_STEP {name}_step
#define PERIOD {period} /* s; 0.0: a step has any length */
#define PERIOD_TEXT "{period}"

typedef {name}_input unit_input;
typedef {name}_output unit_output;
typedef {name}_state unit_state;

/* value references: inputs from 0 on, outputs, flags of the inputs, status */
#define INPUTS {inputs}
#define OUTPUTS {outputs}
#define FIRST_FLAG {flags}
#define STATUS_REFERENCE {status}

static const int may_be_missing[INPUTS] = {{{missing}}};
static const double first_inputs[INPUTS] = {{{first}}};

"""


def unit_source(recipe: Recipe, name: str, guid: str) -> str:
    """Return the text of ``NAME_fmu.c``."""
    top = _TOP.format(
        name=name, upper=name.upper(), guid=guid, period=double(recipe.period or 0.0),
        inputs=len(recipe.inputs), outputs=len(recipe.outputs), flags=first_flag(recipe),
        status=status_reference(recipe), missing=", ".join(str(int(not one)) for one in recipe.finite),
        first=", ".join(double(first_value(*one)) for one in recipe.limits),
    )  # fmt: skip
    return top + files("sdpgrind.codegen._fmi").joinpath("shell.c").read_text(encoding="ascii")
