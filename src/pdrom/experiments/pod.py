"""Snapshots of a group -> basis."""

import logging
from dataclasses import dataclass
from typing import Annotated

from pdrom.core.paths import BASIS, SNAPSHOTS, File
from pdrom.experiments.kit.declaration import Experiment, JobSettings
from pdrom.reduction.basis import compute_basis, save_basis
from pdrom.reduction.method import BasisSpec
from pdrom.reduction.snapshots import load_snapshots

log = logging.getLogger(__name__)


class Settings(JobSettings):
    """What a basis depends on."""

    basis: BasisSpec


@dataclass(frozen=True)
class Inputs:
    """Files read."""

    snapshots: Annotated[File, SNAPSHOTS]


@dataclass(frozen=True)
class Outputs:
    """Files written."""

    basis: Annotated[File, BASIS]


def run(settings: Settings, inputs: Inputs, outputs: Outputs) -> None:
    """Compute and save a basis of the training snapshots."""
    spec, data = settings.basis, load_snapshots(inputs.snapshots.path)
    basis = compute_basis(data.train, data.row_mass, data.roundoff, data.rows_per_element, spec)
    log.info("numerical rank %d of %d snapshots", basis.rank, len(data.train))
    save_basis(basis, outputs.basis.path)


EXPERIMENT = Experiment("pod", "POD of {group} in {scene} ({basis})", run)
