"""An array whose owner is not counted, for compiled code that is called once a reading."""

from typing import Any

from numba.extending import intrinsic


@intrinsic
def borrowed(typing_context: Any, array: Any) -> Any:
    """The same array without its owner; it must not outlive the call that was given the array.

    Compiled code counts the references to the owner of an array and of its slices, at every call and in atomic operations:
    of one reading these cost more than the arithmetic. Where there is no owner nothing is counted.
    """

    def write(context: Any, builder: Any, signature: Any, values: Any) -> Any:
        view = context.make_array(signature.args[0])(context, builder, value=values[0])
        view.meminfo = view.meminfo.type(None)
        return view._getvalue()

    return array(array), write
