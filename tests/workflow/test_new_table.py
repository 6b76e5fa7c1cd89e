"""The recipe of a table: one module, and the pipeline knows it."""

from pathlib import Path

import pytest
import yaml
from checkout import Checkout, copy_repository

from pdrom.core.store import read_table

MODULE = '''"""Table mesh_sizes: vertices of every mesh."""

import pandas as pd

from pdrom.core import paths
from pdrom.core.paths import File
from pdrom.core.reads import Every, Setting
from pdrom.model.mesh import load_mesh
from pdrom.tables.declaration import flag, integer, table, text
from pdrom.tables.vocabulary import VERTICES


@table(
    title="Sizes of the meshes",
    columns=(
        text("mesh", "its identifier"),
        VERTICES,
        flag("large", "more vertices than the blow-up has extents"),
        integer("order", "empty"),
    ),
    reads={"meshes": Every(paths.MESH), "extents": Setting("blowup_extent")},
)
def mesh_sizes(meshes: list[File], extents: float) -> pd.DataFrame:
    """One row per mesh."""
    sizes = [(file["mesh"], load_mesh(file.path).vertices) for file in meshes]
    made = pd.DataFrame(sizes, columns=["mesh", "vertices"])
    return made.assign(large=made.vertices > extents, order=None)
'''
PLACE = Path("src/pdrom/tables/mesh_sizes.py")
STUDY = {"scenes": ["spring_oop"], "methods": ["deim"], "coarsen": {"resolution": 0.25}}
FILE = "one_scene.yaml"
TARGET = "results/tables/mesh_sizes.csv"
ARGUMENTS = (TARGET, "--configfile", FILE)

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def checkout(tmp_path_factory: pytest.TempPathFactory) -> Checkout:
    """A copy of the project with one more table, which was made."""
    made = copy_repository(tmp_path_factory.mktemp("table"))
    (made.folder / PLACE).write_text(MODULE, encoding="utf-8")
    (made.folder / FILE).write_text(yaml.safe_dump(STUDY), encoding="utf-8")
    done = made.snakemake(*ARGUMENTS)
    assert done.returncode == 0, done.stderr
    return made


def test_a_module_is_a_table_of_the_study(checkout: Checkout) -> None:
    (row,) = read_table(checkout.folder / TARGET).itertuples()
    assert row.mesh.startswith("cloth_5x5_xz")
    assert (row.vertices, row.large) == (25, False)
    header = (checkout.folder / TARGET).read_text().splitlines()[0]
    assert header == "mesh,vertices,large,order"
    assert TARGET in checkout.planned("--configfile", FILE, "--forcerun", "mesh_sizes_table")


def test_its_settings_and_its_code_make_it_again(checkout: Checkout) -> None:
    assert checkout.planned(*ARGUMENTS) == set()
    assert checkout.planned(*ARGUMENTS, "--config", "blowup_extent=20") == {TARGET}
    checkout.edit(str(PLACE), "made.vertices > extents", "made.vertices >= extents")
    assert checkout.planned(*ARGUMENTS) == {TARGET}
