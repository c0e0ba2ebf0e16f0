"""An array view without reference counting, for compiled code that runs once for each reading."""

from typing import Any

from numba.extending import intrinsic


@intrinsic
def uncounted(typing_context: Any, array: Any) -> Any:
    """Return a view of an array that holds no reference to the memory; it must not outlive the owner's array.

    Compiled code counts the references to an array and to its slices at every call, by atomic operations: for
    one reading these cost more than the arithmetic.
    """

    def write(context: Any, builder: Any, signature: Any, values: Any) -> Any:
        view = context.make_array(signature.args[0])(context, builder, value=values[0])
        view.meminfo = view.meminfo.type(None)
        return view._getvalue()

    return array(array), write
