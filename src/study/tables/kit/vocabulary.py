"""Columns that several tables share: each name with one meaning."""

from study.tables.kit.declaration import compared, flag, integer, number, text, timed

SCENE = text("scene", "name of the scene")
GROUP = text("group", "constraint group whose projections are reduced; all in a position subspace")
METHOD = text("method", "reduction of the projections; full without one")
POSITION_BASIS = text("position_basis", "basis of the positions: pod, skinning, full (unreduced)")
K = integer("k", "modes of the position basis")
R = compared(
    "value", integer("r", "modes of the projections; in a position subspace the elements evaluated")
)
VERTICES = integer("vertices", "vertices of the mesh")
ELEMENTS = integer("elements", "elements of the group")
ELEMENTS_SAMPLED = compared("value", integer("elements_sampled", "elements that are evaluated"))
FRAMES = compared("error", integer("frames", "frames that the run reached"))
FINITE = compared("error", flag("finite", "no frame blew up"))
BLOWUP_FRAME = compared("error", integer("blowup_frame", "first frame that blew up"))
MAX_EXTENT = compared(
    "error", number("max_extent", "largest extent of a frame over that of the start")
)
GAIN = compared(
    "value", number("gain", "norm of the inverse of the sampled modes; inf if they are singular")
)
ENERGY_RATIO = compared(
    "error", number("energy_ratio", "largest energy over that of the full-order run")
)
RELATIVE_ERROR = compared(
    "error", number("relative_error", "error of the positions over all frames")
)
ERROR_WITHIN = number("relative_error_within_horizon", "error of the positions before the horizon")
ERROR_OVER_EXTENT = compared(
    "error",
    number(
        "error_over_extent",
        "distance of a vertex (root mean square) before the horizon, over the extent",
    ),
)
SHAPE_ERROR = compared(
    "error",
    number(
        "shape_error", "the same with the best rigid motion of each frame taken out: of the shape"
    ),
)
VELOCITY_ERROR = compared(
    # no "error": a run whose positions are right has not failed, whatever its velocities are
    "error",
    number(
        "velocity_error",
        "error of the velocities before the horizon, over the norm of those of the full-order run",
    ),
)
RELATIVE_SHAPE_ERROR = compared(
    "error",
    number(
        "relative_shape_error",
        "error of the positions before the horizon without the best rigid motion of each frame",
    ),
)
ENERGY_DRIFT = compared(
    "error",
    number(
        "energy_drift",
        "largest difference of the total energy before the horizon, over the largest energy of the "
        "full-order run",
    ),
)
CONTACT_DELAY = compared(
    "share",  # absolute: a whole number of frames, of which one is allowed
    number(
        "contact_delay",
        "by how much the first contact with an obstacle before the horizon is late; inf if it is "
        "missed, -inf if the full order has none, empty if neither has",
        "s",
    ),
    tolerance=0.02,
)
# what users look at, of the same frames
USERS = (VELOCITY_ERROR, RELATIVE_SHAPE_ERROR, ENERGY_DRIFT, CONTACT_DELAY)
HORIZON_FRAME = integer("horizon_frame", "first frame that cannot be judged: the scene's horizon")
FLOOR = compared(
    "error", number("sensitivity_floor", "largest drift of perturbed runs before the horizon")
)
MS_PER_FRAME = timed(number("ms_per_frame", "time of a frame", "ms"))
LOCAL_MS = timed(number("local_ms", "time of the local step in a frame", "ms"))
GLOBAL_MS = timed(number("global_ms", "time of the global solve in a frame", "ms"))
SPEEDUP = timed(number("speedup", "time of the full-order run over that of this one"))
SPEEDUP_LOW = timed(number("speedup_low", "2.5 % quantile of this median (bootstrap)"))
SPEEDUP_HIGH = timed(number("speedup_high", "97.5 % quantile"))
LOCAL_SHARE = timed(number("local_share", "local step over it and the global solve"))
