"""What the column ``method`` of tables says of runs without any reduction."""

FOM = "fom"  # the full-order run with its own or another number of iterations
ANDERSON = "fom-anderson"  # the same with accelerated iterations

# phases of a frame beside the effects
RIGHT, GLOBAL, REST = "right-hand side", "global solve", "rest of the frame"
