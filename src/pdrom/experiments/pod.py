"""Rule pod: snapshots -> basis."""

import logging
from typing import Any

from pdrom.core.provenance import attributes
from pdrom.reduction.basis import compute_basis, save_basis
from pdrom.reduction.method import BasisSpec
from pdrom.reduction.snapshots import load_snapshots

log = logging.getLogger(__name__)


def make_basis(spec: dict[str, Any], snapshots: str, output: str) -> None:
    """Compute and save the basis ``spec`` of the training snapshots."""
    data = load_snapshots(snapshots)
    basis = compute_basis(
        data.train,
        data.row_mass,
        data.roundoff,
        data.rows_per_element,
        BasisSpec.model_validate(spec),
    )
    log.info("numerical rank %d of %d snapshots", basis.rank, len(data.train))
    save_basis(basis, output, attributes(spec))
