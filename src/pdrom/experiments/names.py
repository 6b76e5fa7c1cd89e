"""Names of methods that are no reduction, as the tables give them."""

FOM = "fom"  # the full-order run with its own or another number of iterations
ANDERSON = "fom-anderson"  # the same with accelerated iterations
