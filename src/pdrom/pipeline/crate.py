"""A Workflow Run RO-Crate of the last run: what was run on which configuration, and what came out.

Profile: https://w3id.org/ro/wfrun/workflow/0.5. The folder of the results is the crate. It holds
copies of the workflow and of the configuration as they were run. Dates are in the crate and in no
other result, so that it is not among the files that equal runs make equal.
"""

import json
import mimetypes
import os
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from importlib.metadata import PackageNotFoundError, metadata
from pathlib import Path
from typing import Any

import psutil
from rocrate.model.contextentity import ContextEntity
from rocrate.model.entity import Entity
from rocrate.rocrate import ROCrate

from pdrom.core import paths
from pdrom.core.provenance import library_versions
from pdrom.core.store import write_text
from pdrom.core.yamlfile import read_yaml
from pdrom.pipeline.folders import Folders
from pdrom.pipeline.manifest import Manifest
from pdrom.pipeline.plan import Plan
from pdrom.tables import declared

CITATION = Path("CITATION.cff")
COPIES = "workflow"  # below the results
PROFILES = {
    "https://w3id.org/ro/wfrun/process/0.5": "Process Run Crate",
    "https://w3id.org/ro/wfrun/workflow/0.5": "Workflow Run Crate",
    "https://w3id.org/workflowhub/workflow-ro-crate/1.0": "Workflow RO-Crate",
}
RUN_TERMS = "https://w3id.org/ro/terms/workflow-run/context"
_TYPES = {
    ".csv": "text/csv",
    ".smk": "text/x-python",
    ".tex": "application/x-tex",
    ".yaml": "application/yaml",
}


@dataclass(frozen=True)
class Published:
    """A result that readers are given: its entry in the manifest, and what it shows."""

    name: str
    size: int
    sha256: str
    title: str


def write_crate(plan: Plan, folders: Folders, manifest: Manifest) -> None:
    """Write ``ro-crate-metadata.json`` for the run of this process, which has succeeded."""
    crate = ROCrate(version="1.1")
    about = read_yaml(CITATION)
    author = _author(crate, about["authors"][0]["name"])
    license_ = _context(crate, f"https://spdx.org/licenses/{about['license']}", "CreativeWork")
    license_["name"] = about["license"]
    workflow = _workflow(crate, plan, folders.results, about, author, license_)
    results = [_file(crate, each) for each in published(plan, folders, manifest)]
    results.append(_manifest(crate))
    action = _action(crate, workflow, _inputs(crate, plan, folders.results, manifest), results)
    root = crate.root_dataset
    profiles = []
    for place, name in PROFILES.items():
        profiles.append(_context(crate, place, "CreativeWork"))
        profiles[-1]["name"] = name
        profiles[-1]["version"] = place.rpartition("/")[2]
    root["conformsTo"] = profiles
    root["name"] = f"{about['title']}: results of {plan.configuration}"
    root["description"] = "Tables, figures and manuscript with checksums, and what made them."
    root["author"], root["license"], root["mentions"] = author, license_, action
    root["publisher"] = author
    root["datePublished"] = action["endTime"]
    crate.metadata.extra_contexts.append(RUN_TERMS)
    crate.metadata["conformsTo"] = [
        Entity(crate, "https://w3id.org/ro/crate/1.1"),
        Entity(crate, "https://w3id.org/workflowhub/workflow-ro-crate/1.0"),
    ]
    text = json.dumps(crate.metadata.generate(), indent=1, ensure_ascii=False)
    write_text(f"{text}\n", paths.CRATE.at(folders.results))


def published(plan: Plan, folders: Folders, manifest: Manifest) -> list[Published]:
    """Tables, figures, the manuscript with its inputs, and the record of the machine."""
    tables, figures = declared(), plan.figure_jobs
    titles = {paths.TABLE.at("", name=n)[1:]: f"Table {n}: {t.title}" for n, t in tables.items()}
    for name, job in figures.items():
        for place in (paths.FIGURE, paths.FIGURE_PICTURE):
            titles[place.at("", name=name)[1:]] = f"Figure {job.label}: {job.order.title}"
    titles[paths.LIVE_PAGE.at("")[1:]] = "Page on which reduced models run"
    models = Path(paths.LIVE_MODEL.pattern).parent
    titles |= {
        name: f"Models of {Path(name).stem} for the page"
        for name in manifest.files
        if Path(name).parent == models
    }
    pages = [os.path.relpath(path, folders.results) for path in plan.paper.article.outputs.values()]
    titles |= {name: f"The manuscript as a page: {Path(name).name}" for name in pages}
    titles["machine.json"] = "The machine that the study ran on"
    documents = [Path(file).name for file in folders.documents.values()]
    found = []
    for name, entry in manifest.files.items():
        of_paper = Path(name).parent.name == "paper"
        title = titles.get(name) or (of_paper and _of_paper(Path(name), documents))
        if title and entry.sha256:
            found.append(Published(name, entry.bytes, entry.sha256, title))
    return found


def _of_paper(path: Path, documents: Sequence[str]) -> str:
    titles = dict(zip(documents, ("The manuscript", "Supplement of the manuscript"), strict=True))
    return titles.get(path.name, f"Input of the manuscript: {path.stem}")


def _author(crate: ROCrate, name: str) -> Entity:
    author = _context(crate, "#authors", "Organization")
    author["name"] = name
    return author


def _workflow(
    crate: ROCrate,
    plan: Plan,
    results: str,
    about: Mapping[str, Any],
    author: Entity,
    terms: Entity,
) -> Entity:
    """The main workflow, with its parts copied beside it, and the software that ran it."""
    sources = sorted(p for p in (plan.root / "workflow").rglob("*") if p.suffix in (".smk", ".py"))
    parts = [_copy(crate, source, results, plan.root / "workflow") for source in sources]
    _write_copy(plan.root / "workflow" / "Snakefile", results, plan.root / "workflow")
    workflow = crate.add_workflow(dest_path=f"{COPIES}/Snakefile", main=True, lang="snakemake")
    software = []
    for name, version in library_versions().items():
        home = _home(name)
        software.append(_context(crate, home or f"#{name}", "SoftwareApplication"))
        software[-1]["name"], software[-1]["softwareVersion"] = name, version
        if home:
            software[-1]["url"] = home
    workflow["name"], workflow["version"] = about["title"], about["version"]
    workflow["author"], workflow["license"] = author, terms
    workflow["hasPart"], workflow["softwareRequirements"] = parts, software
    return workflow


def _home(package: str) -> str:
    """Address of a package's home page; empty where its metadata name none."""
    try:
        about = metadata(package)
    except PackageNotFoundError:
        return ""
    labelled = (entry.partition(", ") for entry in about.get_all("Project-URL") or [])
    homes = {label.lower(): address for label, _, address in labelled}
    return about["Home-page"] or homes.get("homepage") or homes.get("home") or ""


def _inputs(crate: ROCrate, plan: Plan, results: str, manifest: Manifest) -> list[Entity]:
    """Copies of the configuration, and the settings of the command line."""
    sources = sorted((plan.root / "config").rglob("*.yaml"))
    files = [_copy(crate, source, results, plan.root) for source in sources]
    options = _context(crate, "#options", "PropertyValue")
    options["name"], options["value"] = "options", " ".join(manifest.options) or "none"
    return [*files, options]


def _copy(crate: ROCrate, source: Path, results: str, root: Path) -> Entity:
    _write_copy(source, results, root)
    inside = f"{COPIES}/{source.relative_to(root)}"
    made = crate.add_file(dest_path=inside)
    made["name"], made["encodingFormat"] = source.name, _media_type(source.name)
    return made


def _write_copy(source: Path, results: str, root: Path) -> None:
    write_text(source.read_text("utf-8"), f"{results}/{COPIES}/{source.relative_to(root)}")


def _file(crate: ROCrate, each: Published) -> Entity:
    """A file of the crate; what lies outside of its folder is only mentioned."""
    if each.name.startswith(".."):
        made = _context(crate, f"#{Path(each.name).stem}", "CreativeWork")
        made["description"] = f"{each.name} from this folder"
    else:
        made = crate.add_file(dest_path=each.name)
        made["contentSize"] = str(each.size)
    made["name"], made["sha256"] = each.title, each.sha256
    made["encodingFormat"] = _media_type(each.name)
    return made


def _manifest(crate: ROCrate) -> Entity:
    made = crate.add_file(dest_path=paths.MANIFEST.pattern)
    made["name"], made["encodingFormat"] = "Checksums and provenance", "application/json"
    made["description"] = "Every result, HDF5 files too, with its checksum and what made it"
    return made


def _action(
    crate: ROCrate, workflow: Entity, inputs: Iterable[Entity], results: Iterable[Entity]
) -> Entity:
    action = _context(crate, "#run", "CreateAction")
    start = datetime.fromtimestamp(psutil.Process().create_time(), UTC)
    action["name"] = "The last run that changed results"
    action["description"] = "Snakemake made what was missing or out of date, and kept the rest."
    action["instrument"], action["object"] = workflow, list(inputs)
    action["result"], action["startTime"] = list(results), start.isoformat(timespec="seconds")
    action["endTime"] = datetime.now(UTC).isoformat(timespec="seconds")
    action["actionStatus"] = "http://schema.org/CompletedActionStatus"
    return action


def _context(crate: ROCrate, identifier: str, kind: str) -> Entity:
    return crate.add(ContextEntity(crate, identifier, properties={"@type": kind}))


def _media_type(name: str) -> str:
    return _TYPES.get(Path(name).suffix) or mimetypes.guess_type(name)[0] or "text/plain"
