"""Projections from S q alone, as compiled functions that other compiled code calls by address.

In a position subspace S q comes from a small dense product, not from vertices. A group states the
projection of a batch as a function of S q and of a few numbers per element; the iterations of a
subspace call it through its address, so that one compiled loop serves every mix of groups.
"""

from llvmlite import ir
from numba import types
from numba.extending import intrinsic

from pdrom.model.compiled.functions import Callback

_SIGNATURE = types.void(
    types.CPointer(types.float64),
    types.CPointer(types.float64),
    types.CPointer(types.float64),
    types.intp,
)


def gradient_kernel(function):
    """Compile ``function(d, parameters, p, m)``; its attribute ``address`` is what `call` takes.

    d : pointer to (m, rows, 3) values of S q
    parameters : pointer to the numbers of `ConstraintGroup.kernel_parameters`
    p : pointer to (m, rows, 3), where the projections go
    """
    return Callback(function, _SIGNATURE)


@intrinsic
def call(typing_context, address, d, parameters, p, m):
    """Call a gradient kernel by its ``address``.

    ``d``, ``parameters`` and ``p``, see `gradient_kernel`, are addresses; ``m`` elements.
    ``typing_context`` is Numba's own: callers leave it out.
    """
    integers = (types.intp,) * 5

    def generate(context, builder, signature, arguments):
        integer = ir.IntType(types.intp.bitwidth)
        kind = ir.FunctionType(ir.VoidType(), [integer] * 4)
        function = builder.inttoptr(arguments[0], kind.as_pointer())
        builder.call(function, arguments[1:])
        return context.get_dummy_value()

    return types.void(*integers), generate
