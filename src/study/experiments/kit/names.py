"""Names of runs without any reduction in the column ``method`` of tables."""

FOM = "fom"  # the full-order run with its own or another number of iterations
ANDERSON = "fom-anderson"  # the same with accelerated iterations

# phases of a frame other than effects
RIGHT, GLOBAL, REST = "right-hand side", "global solve", "rest of the frame"
