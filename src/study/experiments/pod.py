"""Compute the POD basis of a constraint group's projections from snapshots."""

import logging

from pdrom.reduction.basis import basis_of, save_basis
from pdrom.reduction.method import BasisSpec
from pdrom.reduction.snapshots import load_snapshots
from study.artifact.paths import BASIS, SNAPSHOTS, File
from study.artifact.reads import Setting
from study.experiments.kit.base import experiment

log = logging.getLogger(__name__)


@experiment(
    "POD of {group} in {scene} ({basis})",
    reads={"snapshots": SNAPSHOTS, "spec": Setting("basis")},
    writes={"out": BASIS},
)
def pod(snapshots: File, spec: BasisSpec, out: File) -> None:
    """Compute the basis of ``spec`` from the training ``snapshots`` and save it to ``out``."""
    data = load_snapshots(snapshots.path)
    basis = basis_of(data, spec)
    log.info("numerical rank %d of %d snapshots", basis.rank, len(data.train))
    save_basis(basis, out.path)
