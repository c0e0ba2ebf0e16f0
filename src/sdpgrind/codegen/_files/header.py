"""Header of an export: types with units, constants, three functions, the promise."""

from sdpgrind.codegen._recipe import Recipe, Signal, shown
from sdpgrind.codegen._translate.values import comment, double

_HEADER = """\
/*
 * {name}.h: {kind}, exported by sdpgrind {version}.
 * {promise}
{equations} *
 * {instances}
 * {name}_step returns
{status} *   -1  an input is out of the range that stands beside it, no number where one must be, or
 *       refused as its meaning says
 *   -2  a loop has reached its bound
 *   -3  a number was no index
 * Below 0 neither state nor output has changed.
 * {name}_digest returns {upper}_DIGEST, or a number of a constant table is not the one that was exported.
 *
 * Deviations from MISRA C:2012: several returns in a function (15.5), pointers into arrays (18.4 is kept:
 * there is no arithmetic on pointers), volatile copies before calls of math.h, without which a compiler may
 * compute them by itself, with other bits.
 */
#ifndef {upper}_H
#define {upper}_H

#include <stdint.h>

#ifdef __cplusplus
extern "C" {{
#endif

{constants}

typedef struct {{
{inputs}
}} {name}_input;

typedef struct {{
{outputs}
}} {name}_output;

typedef struct {{
    double s[{upper}_STATE_SIZE];
}} {name}_state;

void {name}_reset({name}_state *state);
int32_t {name}_step({name}_state *state, const {name}_input *in, {name}_output *out);
uint64_t {name}_digest(void);

#ifdef __cplusplus
}}
#endif

#endif
"""


_INSTANCES = "Any number of instances, one a thread: all that changes is in {name}_state."
_ONE = "Any number of instances, one step at a time: the solver in {name}_program.c works on static arrays."


def header(recipe: Recipe, name: str, version: str, promise: str, digest: int) -> str:
    """Return the text of the header; `digest`: of the constant tables."""
    equations = "".join(f" * {line}\n" for line in recipe.equations.splitlines())
    return _HEADER.format(
        name=name, upper=name.upper(), kind=recipe.kind, version=version, promise=promise,
        equations=equations, instances=(_INSTANCES if recipe.program is None else _ONE).format(name=name),
        status="".join(f" *   {k:2d}  {one}\n" for k, one in enumerate(recipe.status)),
        constants=_constants(recipe, name.upper(), version, digest),
        inputs="\n".join(_field(name, one, *_taken(one)) for name, one in recipe.inputs.items()),
        outputs="\n".join(_field(name, one) for name, one in recipe.outputs.items()),
    )  # fmt: skip


def _field(name: str, one: Signal, *taken: str) -> str:
    """Return a field with its meaning above it, its unit and what is `taken` behind it."""
    above = [comment(one.meaning, "    ")] if one.meaning else []
    return "\n".join([*above, f"    double {name}; /* {', '.join([one.unit or '1', *taken])} */"])


def _taken(one: Signal) -> list[str]:
    """Return the range of an input, and what NaN is."""
    return [f"{shown(one.low)} to {shown(one.high)}", *(["NaN: no reading"] if one.missing else [])]


def _constants(recipe: Recipe, upper: str, version: str, digest: int) -> str:
    lines = [f'#define {upper}_VERSION "{version}"', f'#define {upper}_FINGERPRINT "{recipe.fingerprint}"']
    lines.append(f"#define {upper}_DIGEST UINT64_C({digest:#018x})")
    lines.append(f"#define {upper}_STATE_SIZE {recipe.state.size}")
    if recipe.period is not None:
        lines.append(f"#define {upper}_PERIOD {double(recipe.period)} /* s */")
    lines += [f"#define {upper}_AT_{one.upper()} {place}" for one, place in recipe.places.items()]
    return "\n".join(lines)
