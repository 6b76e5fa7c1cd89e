"""The recipe of an experiment: one module, and the pipeline knows it."""

from pathlib import Path

import pytest
from checkout import Checkout, copy_repository

from pdrom.core.store import read_table

MODULE = '''"""Lengths of a scene's springs at rest."""

from dataclasses import dataclass
from typing import Annotated

import numpy as np
import pandas as pd

from pdrom.core.paths import MESH, File, Place
from pdrom.core.store import write_table
from pdrom.experiments.declaration import Experiment, JobSettings
from pdrom.experiments.scenes import scene_of
from pdrom.experiments.settings import BlowupExtent
from pdrom.model.scene import SceneConfig

REST_LENGTHS = Place("rest_lengths/{scene}.csv")


class Settings(JobSettings):
    """What the lengths depend on."""

    scene: SceneConfig
    blowup_extent: BlowupExtent


@dataclass(frozen=True)
class Inputs:
    """Files read."""

    mesh: Annotated[File, MESH]


@dataclass(frozen=True)
class Outputs:
    """Files written."""

    table: Annotated[File, REST_LENGTHS]


def run(settings: Settings, inputs: Inputs, outputs: Outputs) -> None:
    """Write the lengths, in units of the largest extent that a run may have."""
    scene = scene_of(settings.scene, inputs.mesh)
    lengths = np.linalg.norm(scene.group("spring").S @ scene.mesh.points, axis=1)
    allowed = settings.blowup_extent * scene.mesh.extent
    table = pd.DataFrame({"scene": outputs.table["scene"], "length": lengths / allowed})
    write_table(table, outputs.table.path)


EXPERIMENT = Experiment("rest_lengths", "Rest lengths of the springs of {scene}", run)
'''
PLACE = Path("src/pdrom/experiments/rest_lengths.py")
TARGET = "results/rest_lengths/spring_oop.csv"
ARGUMENTS = (TARGET, "--configfile", "config/tiny.yaml")

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def checkout(tmp_path_factory: pytest.TempPathFactory) -> Checkout:
    """A copy of the project with one more experiment."""
    made = copy_repository(tmp_path_factory.mktemp("experiment"))
    (made.folder / PLACE).write_text(MODULE, encoding="utf-8")
    return made


@pytest.fixture(scope="module")
def ran(checkout: Checkout) -> str:
    """What the run said that made the new result."""
    done = checkout.snakemake(*ARGUMENTS)
    assert done.returncode == 0, done.stderr
    return done.stdout + done.stderr


def test_a_module_is_an_experiment_of_the_pipeline(checkout: Checkout, ran: str) -> None:
    assert "Rest lengths of the springs of spring_oop" in ran
    table = read_table(checkout.folder / TARGET)
    # a sheet of 8 x 8 vertices: sides and diagonals of its cells, of a hundred extents
    assert sorted(set((100.0 * table.length).round(6))) == [0.142857, 0.202031]
    assert set(table.scene) == {"spring_oop"}


def test_its_settings_and_its_code_make_it_run_again(checkout: Checkout, ran: str) -> None:
    assert checkout.planned(*ARGUMENTS) == set()
    assert checkout.planned(*ARGUMENTS, "--config", "blowup_extent=50") == {TARGET}
    checkout.edit(str(PLACE), "lengths / allowed", "lengths / allowed / 1.0")
    assert checkout.planned(*ARGUMENTS) == {TARGET}
