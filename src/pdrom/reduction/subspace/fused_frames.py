"""Compiled iterations and frames of `pdrom.reduction.subspace.fused`."""

from pdrom.model.compiled.clock import now
from pdrom.model.compiled.functions import compiled, inner
from pdrom.model.compiled.rows import write
from pdrom.model.constraints.gradient_kernel import call
from pdrom.model.dynamics.acceleration import combine, forget, refuse
from pdrom.reduction.subspace.dense import product


@compiled(nogil=True)
def iterations(count, size, rows, operators, sampled, history):
    """Do ``count`` iterations of the ``size`` free coordinates z, in place.

    Parameters
    ----------
    rows : of the sampled strain D
    operators : see ``iterated`` of `_Operators`
    sampled : arrays of `_Sampled`
    history : of the acceleration, see `Anderson`; `NO_HISTORY` without one
    """
    strain, lift, offset, constant, z, weights, inertia, start = operators
    addresses, elements, starts, parameters, parameter_starts, d, p = sampled
    y = z[: 3 * size]
    if history is not None:
        write(y, start)
        forget(history)
    for k in range(count):
        product(strain, rows, size, offset, z, d)
        for g in range(len(addresses)):
            call(
                addresses[g],
                d[3 * starts[g] :].ctypes.data,
                parameters[parameter_starts[g] :].ctypes.data,
                p[3 * starts[g] :].ctypes.data,
                elements[g],
            )
        refused = False
        if history is not None:
            refused = refuse(history, y, _objective(weights, d, p, inertia, y, start))
        if not refused:
            product(lift, size, rows, constant, p, z)
            if history is not None and k < count - 1:
                combine(history, y)


@inner
def _objective(weights, d, p, inertia, y, s):
    """1/2 sum_i w_i |d_i - p_i|^2 + 1/2 (y - s)^T (M/h^2) (y - s)."""
    total = 0.0
    for i in range(len(weights)):
        for axis in range(3):
            total += weights[i] * (d[3 * i + axis] - p[3 * i + axis]) ** 2
    for i in range(len(inertia)):
        for axis in range(3):
            moved = 0.0
            for k in range(i):
                moved += inertia[i, k] * (y[3 * k + axis] - s[3 * k + axis])
            own = y[3 * i + axis] - s[3 * i + axis]
            total += own * (2.0 * moved + inertia[i, i] * own)
    return 0.5 * total


@inner
def _predict(z, v, acceleration, rate, rates, h, s):
    """Write s = z + h v + h^2 (a + c v + C v)."""
    for i in range(len(z)):
        for axis in range(3):
            total = acceleration[i, axis] + rate * v[i, axis]
            for k in range(len(rates)):
                total += rates[i, k] * v[k, axis]
            s[3 * i + axis] = z[i, axis] + h * v[i, axis] + h**2 * total


@compiled(nogil=True)
def frames(
    positions, velocities, acceleration, rate, rates, h, fixed, free, targets, begun, count,
    rows, operators, sampled, history, seconds, watch,
):  # fmt: skip
    """Do a frame for each of ``targets``, with the iterations of `iterations`.

    Parameters
    ----------
    positions, velocities : (F + 1, K, 3) coordinates, the first ones given, the others written
    acceleration, rate, rates : by all forces, see `ReducedSpace.affine`
    h : time step, s
    fixed, free : (m,), (K',) held coordinates and the others
    targets : (F, m, 3) of the held coordinates
    begun : see `_Operators`
    count, rows, operators, sampled, history : see `iterations`
    seconds : (F, 4) s, times of the phases of each frame, written
    watch : clock, see `pdrom.model.compiled.clock`
    """
    response, coupling, nothing, s, held = begun
    offset, constant, z = operators[2:5]
    for f in range(len(targets)):
        began = now(watch)
        before, after, speeds = positions[f], positions[f + 1], velocities[f + 1]
        _predict(before, velocities[f], acceleration, rate, rates, h, s)
        for i in range(len(fixed)):
            for axis in range(3):
                s[3 * fixed[i] + axis] = held[3 * i + axis] = targets[f, i, axis]
        product(response, len(free), len(before), nothing, s, constant)
        # targets that stay the same have the product of the frame before
        if f == 0 or (targets[f] != targets[f - 1]).any():
            product(coupling, rows, len(fixed), nothing, held, offset)
        for i in range(len(free)):
            for axis in range(3):
                z[3 * i + axis] = s[3 * free[i] + axis]
        between = now(watch)
        iterations(count, len(free), rows, operators, sampled, history)
        ended = now(watch)
        for i in range(len(free)):
            for axis in range(3):
                s[3 * free[i] + axis] = z[3 * i + axis]
        for i in range(len(before)):
            for axis in range(3):
                after[i, axis] = s[3 * i + axis]
                speeds[i, axis] = (after[i, axis] - before[i, axis]) / h
        seconds[f, 0], seconds[f, 1] = between - began, ended - between
        seconds[f, 3] = now(watch) - ended
