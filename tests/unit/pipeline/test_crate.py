"""The crate has what its profiles require, and checksums of what it names.

The properties are those of Process Run Crate 0.5 and Workflow Run Crate 0.5, with RO-Crate 1.1; the
validator of these profiles brings more packages than the study and was asked by hand.
"""

import hashlib
import json
from pathlib import Path

import pandas as pd
import pytest
from rocrate.rocrate import ROCrate

from pdrom.core import paths
from pdrom.core.store import write_table, write_text
from pdrom.core.yamlfile import read_yaml
from pdrom.pipeline.crate import PROFILES, write_crate
from pdrom.pipeline.folders import Folders
from pdrom.pipeline.manifest import write_manifest
from pdrom.pipeline.plan import load_plan
from places import ROOT


@pytest.fixture(scope="module")
def entities(tmp_path_factory):
    """Entities of a crate by identifier; its study has a table, the machine and the manuscript."""
    folder = tmp_path_factory.mktemp("study")
    for name in ("config", "workflow", "paper", "CITATION.cff"):
        (folder / name).symlink_to(ROOT / name)
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(folder)
        config = {**read_yaml(Path("config/default.yaml")), "scenes": ["bend_fall"]}
        plan = load_plan(config, Path(), quiet=True)
        write_table(pd.DataFrame({"claim": ["C1"]}), paths.TABLE.at("results", name="claims"))
        write_text("{}", paths.MACHINE.at("results"))
        folders = Folders(manuscript="results/paper/main.pdf")
        write_text("a PDF", folders.manuscript)
        manifest, changed = write_manifest(plan, folders, ["--config", "ranks=[3]"])
        assert changed
        write_crate(plan, folders, manifest)
        crate = json.loads(Path("results/ro-crate-metadata.json").read_text("utf-8"))
    entities = {entity["@id"]: entity for entity in crate["@graph"]}
    return {**entities, "folder": folder / "results"}


def identifiers(value: dict | list) -> list[str]:
    """Identifiers that a property refers to."""
    return [each["@id"] for each in (value if isinstance(value, list) else [value])]


def test_a_reader_of_crates_finds_every_entity_and_file(entities):
    crate = ROCrate(entities["folder"])
    read = {entity.id for entity in crate.get_entities()}
    assert read == set(entities) - {"folder"}
    assert crate.mainEntity["programmingLanguage"]["name"] == "Snakemake"
    local = [each.id for each in crate.data_entities if each.type == "File"]
    assert local
    assert [name for name in local if not (entities["folder"] / name).is_file()] == []


def test_the_profiles_are_declared(entities):
    assert identifiers(entities["./"]["conformsTo"]) == list(PROFILES)
    assert set(PROFILES) <= set(entities)
    assert "https://w3id.org/ro/crate/1.1" in identifiers(
        entities["ro-crate-metadata.json"]["conformsTo"]
    )


def test_licence_and_author_are_those_of_the_citation(entities):
    citation = read_yaml(ROOT / "CITATION.cff")
    root = entities["./"]
    assert entities[root["author"]["@id"]]["name"] == citation["authors"][0]["name"]
    assert root["license"]["@id"] == "https://spdx.org/licenses/MIT"
    assert {"name", "description", "datePublished"} <= set(root)


def test_the_run_used_the_workflow_and_made_the_results(entities):
    workflow = entities[entities["./"]["mainEntity"]["@id"]]
    assert {"File", "SoftwareSourceCode", "ComputationalWorkflow"} <= set(workflow["@type"])
    assert "snakemake" in workflow["programmingLanguage"]["@id"]
    run = entities[entities["./"]["mentions"]["@id"]]
    assert (run["@type"], run["instrument"]["@id"]) == ("CreateAction", workflow["@id"])
    assert run["startTime"] <= run["endTime"]
    assert {"tables/claims.csv", "machine.json", "paper/main.pdf", "manifest.json"} == set(
        identifiers(run["result"])
    )
    assert "workflow/config/claims.yaml" in identifiers(run["object"])
    assert entities["#options"]["value"] == "--config ranks=[3]"


def test_every_file_is_there_and_has_its_checksum(entities):
    files = [e for e in entities.values() if isinstance(e, dict) and "File" in e["@type"]]
    assert len(files) > 20
    parts = identifiers(entities["./"]["hasPart"])
    for file in files:
        path = entities["folder"] / file["@id"]
        assert path.is_file()
        assert file["@id"] in parts
        if "sha256" in file:
            assert file["sha256"] == hashlib.sha256(path.read_bytes()).hexdigest()
    assert sum("sha256" in file for file in files) == 3
