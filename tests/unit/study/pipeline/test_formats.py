"""Files of results have the layout that docs/verification.md lists."""

import os
import re
from pathlib import Path

import h5py
import pytest

from pdrom.core.provenance import RECORD
from pdrom.core.yamlfile import read_yaml
from pdrom.model.held_out import MOTIONS
from pdrom.model.scene import Scene
from places import ROOT
from study.artifact.paths import FULL_ORDER, HELDOUT
from study.pipeline.folders import Folders
from study.pipeline.plan import load_plan

SCENE, GROUP, METHOD = "strain_oop", "strain", "block-deim"
# Rules in the order in which one reads what another writes, with the labels of a job.
RULES = [
    ("mesh", {}),
    ("fom", {"scene": SCENE}),
    ("sensitivity", {"scene": SCENE}),
    ("references", {"scene": SCENE}),
    ("snapshots", {"scene": SCENE, "group": GROUP}),
    ("pod", {"scene": SCENE, "group": GROUP}),
    ("reruns", {"scene": SCENE, "group": GROUP, "method": METHOD}),
]
ROW = re.compile(r"^\| `([^`]+)` \| ([^|]+) \| (\w+) \| ([^|]*)\|", re.MULTILINE)


def documented() -> dict[str, dict[str, tuple[str, str, str]]]:
    """Shape, type and unit of each dataset, by the pattern of the file."""
    parts = re.split(
        r"^##+ ", (ROOT / "docs" / "verification.md").read_text("utf-8"), flags=re.MULTILINE
    )
    found = {}
    for part in parts:
        pattern = re.match(r"`([^`]+\.h5)`\n", part)
        if pattern:
            rows = ROW.findall(part)
            found[pattern[1]] = {n: (shape, kind, unit.strip()) for n, shape, kind, unit in rows}
    return found


@pytest.fixture(scope="module")
def files(tmp_path_factory):
    """A file of each kind, of a small sheet, by its pattern."""
    with pytest.MonkeyPatch.context() as patch:
        folder = tmp_path_factory.mktemp("formats")
        patch.chdir(ROOT)
        config = {
            **read_yaml(Path("config/default.yaml")),
            "scenes": [SCENE],
            "methods": [METHOD],
            "ranks": [3, "full"],
            "coarsen": {"resolution": 0.3, "frames": 0.1},
        }
        plan = load_plan(config, folders=Folders(os.fspath(folder)), quiet=True)
        more = {
            "mesh": {"mesh": plan.study.mesh_of(SCENE)},
            "pod": {"basis": plan.study.methods[METHOD].basis_id},
        }
        made = {}
        for name, labels in RULES:
            job = plan.job(plan.experiments[name], {**labels, **more.get(name, {})})
            job.make(job.outputs)
            made |= {job.artifact.writes[key].pattern: path for key, path in job.outputs.items()}
        made[FULL_ORDER.pattern] = made[HELDOUT.pattern]
    config = plan.study.scene(SCENE)
    return made, Scene.build(config, config.mesh.build(ROOT))


def value(expression: str, symbols: dict[str, int], size: int) -> int:
    """A shape's entry; a single new symbol is defined by the size that it has."""
    if expression not in symbols and expression.isalpha():
        symbols[expression] = size
    if expression.startswith("G + "):
        symbols.setdefault("G", size - 1)
    return eval(expression.replace(" + ", "+").replace(" ", "*"), symbols.copy())


@pytest.mark.parametrize("pattern", list(documented()))
def test_a_written_file_has_the_layout_of_the_page(pattern, files):
    made, scene = files
    group = scene.group(GROUP)
    told = documented()[pattern]
    known = {"N": scene.mesh.vertices, "F": scene.config.frames, "K": scene.config.iterations}
    known |= {"e": group.elements, "p": group.rows_per_element}
    seen = set()
    with h5py.File(made[pattern]) as file:
        assert {*RECORD, "configuration", "units"} <= set(file.attrs)
        names: list[str] = []
        file.visititems(
            lambda name, item: names.append(name) if isinstance(item, h5py.Dataset) else None
        )
        known |= {"R": int(file.attrs["rank"])} if "rank" in file.attrs else {}
        for name in names:
            short = re.sub(r"\br\d{4}\b", "r{r}", name).replace(f"/{GROUP}/", "/{group}/")
            short = re.sub(rf"^({'|'.join(MOTIONS)})/", "", short)
            seen.add(short)
            shape, kind, unit = told[short]
            data = file[name]
            entries = shape.split(" x ")
            # sizes of one part of a file
            local = {key: size for key, size in known.items() if key not in "stG"}
            pairs = zip(entries, data.shape, strict=True)
            expected = [value(entry, local, size) for entry, size in pairs]
            known |= {key: size for key, size in local.items() if key not in "stG"}
            assert (list(data.shape), str(data.dtype)) == (expected, kind)
            assert data.attrs.get("unit", unit) == unit
    assert seen == set(told)
