"""Steps that can be exported as C: what their kernels must have."""

import ast
import inspect
import textwrap
from importlib import import_module

import pytest

from sdpgrind.base.compiling.kernel_digest import reached

STEPS = {
    "plunge": "sdpgrind.plunge._control.control_kernels:control_step",
    "plunge, start": "sdpgrind.plunge._control.control_kernels:start_control",
    "torque": "sdpgrind.finishing.torque._controller_kernels:command_step",
    "force": "sdpgrind.weldbead.force._kernels:control_step",
    "predictive force, to its program": "sdpgrind.weldbead.force._predictive_kernels:exported_ask",
    "predictive force, from its program": "sdpgrind.weldbead.force._predictive_kernels:exported_answer",
    "table of a locus": "sdpgrind.locus._trace.table_kernels:look_up",
    "controller on a locus": "sdpgrind.locus._path.walk_kernels:walk_step",
    "policy": "sdpgrind.sdp._policy.look_up_kernels:act",
    "policy, one state": "sdpgrind.sdp._policy.single_kernels:act_at",
    "policy, value of one state": "sdpgrind.sdp._policy.single_kernels:value_at",
    "estimator of a circle": "centering.circle._estimator.update_kernels:update_step",
    "validity of its estimate": "centering.circle._estimator.validity_kernels:judge",
    "recursive least squares": "sdpgrind.identify._exported_kernels:exported_row",
    "filter of random walks": "sdpgrind.identify._exported_kernels:exported_walk",
    "filter, one combination": "sdpgrind.identify._exported_kernels:exported_walk_of_row",
    "strategy of pushes": "centering.cycle._strategy.lookup_kernels:choose",
    "strategy of pushes, exported": "centering.cycle._strategy.exported_kernels:exported_push",
}


def kernels(step):
    """Kernels that a step consists of, by name; code of numba's own, such as `uncounted`, has no options."""
    module, name = STEPS[step].split(":")
    parts = reached(getattr(import_module(module), name))
    return {one.__name__: one for one in parts if hasattr(one, "targetoptions")}


def source(kernel):
    lines, _ = inspect.getsourcelines(kernel.py_func)
    return lines, ast.parse(textwrap.dedent("".join(lines)))


@pytest.mark.parametrize("step", STEPS)
def test_no_kernel_of_a_step_raises_or_reorders(step):
    """C divides by zero without a word; numba's default raises, and fast math changes bits."""
    wrong = [name for name, kernel in kernels(step).items() if _options(kernel) != ("numpy", False)]
    assert not wrong, f"without error_model='numpy', or with fast math: {', '.join(wrong)}"


def _options(kernel):
    options = kernel.targetoptions
    return options.get("error_model", "python"), bool(options.get("fastmath", False))


@pytest.mark.parametrize("step", STEPS)
def test_every_loop_of_a_step_has_a_bound(step):
    """But those of a tape, which becomes straight lines."""
    for name, kernel in kernels(step).items():
        if kernel.py_func.__module__ == "sdpgrind.locus._problem.tape_kernels":
            continue
        lines, tree = source(kernel)
        for loop in (node for node in ast.walk(tree) if isinstance(node, ast.While)):
            assert "# at most " in lines[loop.test.end_lineno - 1], f"{name}: a loop without a stated bound"


@pytest.mark.parametrize("step", STEPS)
def test_no_exponent_that_a_compiler_replaces(step):
    """LLVM makes x*x of pow(x, 2.0), 1/x of pow(x, -1.0), a root of pow(x, 0.5): other bits than pow's."""
    for name, kernel in kernels(step).items():
        for node in ast.walk(source(kernel)[1]):
            if isinstance(node, ast.BinOp) and isinstance(node.op, ast.Pow):
                assert ast.unparse(node.right) not in ("2.0", "-1.0", "0.5"), f"{name}: {ast.unparse(node)}"
