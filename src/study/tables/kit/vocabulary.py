"""Columns that several tables share, so that a column name has the same meaning in each."""

from study.tables.kit.declaration import Column, flag, integer, number, text, timed

_COLUMNS = (
    text("scene", "name of the scene"),
    text("group", "constraint group whose projections are reduced; all in a position subspace"),
    text("method", "reduction of the projections; full without one"),
    text("position_basis", "basis of the positions: pod, skinning, full (unreduced)"),
    integer("k", "modes of the position basis"),
    integer(
        "r",
        "modes of the projections; in a position subspace the elements evaluated",
        compared="value",
    ),
    integer("vertices", "vertices of the mesh"),
    integer("elements", "elements of the group"),
    integer("elements_sampled", "elements that are evaluated", compared="value"),
    integer("frames", "frames that the run reached", compared="error"),
    flag("finite", "no frame blew up", compared="error"),
    integer("blowup_frame", "first frame that blew up", compared="error"),
    number("max_extent", "largest extent of a frame over that of the start", compared="error"),
    number("gain", "norm of the inverse of the sampled modes; inf if they are singular"),
    number("energy_ratio", "largest energy over that of the full-order run", compared="error"),
    number("relative_error", "error of the positions over all frames"),
    number("relative_error_within_horizon", "error of the positions before the horizon"),
    number(
        "playback_error",
        "error of playback before the horizon: of the recorded training motion in place of the run",
    ),
    number(
        "error_over_extent",
        "distance of a vertex (root mean square) before the horizon, over the extent",
    ),
    number(
        "shape_error", "the same with the best rigid motion of each frame taken out: of the shape"
    ),
    number(
        "velocity_error",
        "error of the velocities before the horizon, over the norm of those of the full-order run",
    ),
    number(
        "relative_shape_error",
        "error of the positions before the horizon without the best rigid motion of each frame",
    ),
    number(
        "energy_drift",
        "largest difference of the total energy before the horizon, over the largest energy of the "
        "full-order run",
        compared="error",
    ),
    number(
        "contact_delay",
        "by how much the first contact with an obstacle before the horizon is late; inf if it is "
        "missed, -inf if the full order has none, empty if neither has",
        "s",
        compared="share",
        tolerance=0.02,  # s, chosen to allow a difference of one frame
    ),
    integer("horizon_frame", "first frame that cannot be judged: the scene's horizon"),
    number(
        "sensitivity_floor", "largest drift of perturbed runs before the horizon", compared="error"
    ),
    timed(number("ms_per_frame", "time of a frame", "ms")),
    timed(number("vertices_ms", "of it, the positions of all vertices from coordinates", "ms")),
    timed(number("local_ms", "time of the local step in a frame", "ms")),
    timed(number("global_ms", "time of the global solve in a frame", "ms")),
    timed(number("speedup", "time of the full-order run over that of this one")),
    timed(number("speedup_low", "2.5 % quantile of this median (bootstrap)")),
    timed(number("speedup_high", "97.5 % quantile")),
    timed(number("local_share", "local step over it and the global solve")),
)
_BY_NAME = {column.name: column for column in _COLUMNS}


def shared(names: str) -> list[Column]:
    """Shared columns for the space-separated ``names``; KeyError for a name that is not shared."""
    return [_BY_NAME[name] for name in names.split()]
