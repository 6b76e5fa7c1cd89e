"""Jobs of the manuscript."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from pdrom.model.constraints.base import GroupConfig
from pdrom.view.text import require_typeset
from study.article.build import article
from study.artifact.paths import MACHINE, TABLE
from study.artifact.reads import Paths, ProjectFile
from study.paper.build import Facts, paper, paper_inputs
from study.paper.source import source_files
from study.pipeline.figures import FigureJob
from study.pipeline.fingerprint import digest, fingerprint
from study.pipeline.full import FULL_STUDY, is_full
from study.pipeline.resolve import Job, listed
from study.pipeline.study import Study
from study.tables import declared
from study.tables.claims import load_claims

Row = dict[str, Any]
REFERENCES = "paper/references.bib"


@dataclass(frozen=True)
class PaperJobs:
    """The manuscript: the job of the files that its source reads, its own, that of its pages."""

    inputs: Job
    manuscript: Job
    article: Job

    @property
    def files(self) -> list[str]:
        """Generated files that its source reads."""
        return list(self.inputs.outputs.values())

    @property
    def sources(self) -> list[str]:
        """Its source: both documents, then what they read."""
        return listed(self.manuscript.inputs["source"])


def paper_jobs(
    study: Study,
    figures: Mapping[str, FigureJob],
    configuration: str,
    results: str,
    documents: dict[str, str],
) -> PaperJobs:
    """The manuscript of a study.

    Parameters
    ----------
    figures : by name
    configuration : what the study was read from, for a manuscript that is not of the full one
    results : folder of the results
    documents : files of the PDFs by the name of their source
    """
    facts = Facts(
        captions={name: figure.tex for name, figure in figures.items()},
        part=None if is_full(study) else configuration,
        full_study=FULL_STUDY,
        tables={
            "study": [_study(study)],
            "methods": [
                {"method": name, **method.model_dump(mode="json")}
                for name, method in study.methods.items()
            ],
            "scenes": [_scene(study, name) for name in study.scenes],
        },
    )
    settings, code = {"facts": facts.model_dump(mode="json")}, fingerprint(paper.module)
    sources = source_files(study.root)
    read: dict[str, Paths] = {
        "source": sources,
        "references": REFERENCES,
        "tables": [TABLE.at(results, name=name) for name in declared()],
        "machine": MACHINE.at(results),
    }
    made = {name: place.at(results) for name, place in paper_inputs.writes.items()}
    content = digest(study.root, *sources, REFERENCES)
    inputs = Job(paper_inputs, {}, read, made, settings, content, code)
    pictures = [figure.pdf for figure in figures.values()]
    read = {"source": sources, "inputs": list(made.values()), "figures": pictures}
    content = digest(study.root, *sources)
    manuscript = Job(paper, {}, read, documents, settings, content, code)
    given = {
        **inputs.inputs,
        **read,
        "figures": [f for one in figures.values() for f in (one.pdf, one.png)],
    }
    return PaperJobs(inputs, manuscript, _article(study, given, settings, results))


def _article(study: Study, given: Mapping[str, Paths], settings: Row, results: str) -> Job:
    """The manuscript as pages; ``given`` is what the plan names of its inputs."""
    edited = {name: r.path for name, r in article.files.items() if isinstance(r, ProjectFile)}
    places = {name: place.at(results) for name, place in article.writes.items()}
    content = digest(study.root, *listed(given["source"]), REFERENCES, *edited.values())
    read = {**given, **edited}
    added = {name: list(scenes) for name, scenes in study.settings.claim_sets.items()}
    settings = {**settings, "added": added}
    return Job(article, {}, read, places, settings, content, fingerprint(article.module))


def check_texts(study: Study) -> None:
    """ConfigurationError for a text of ``study`` that figures or TeX cannot typeset."""
    folder, ladder = study.root / "config", study.settings.ladder
    for name, method in study.methods.items():
        require_typeset(method.title, f"{folder / 'methods.yaml'}: {name}.title")
    for key, rungs in {"up": ladder.up, "down": ladder.down}.items():
        for i, rung in enumerate(rungs):
            require_typeset(rung.title, f"ladder.{key}.{i}.title")
    for name, claim in load_claims(folder / "claims.yaml").items():
        words = ("text", "source", "paper", "section", "shown", "qualifiers")
        texts = {key: getattr(claim, key) for key in words}
        for part in ("published", "beyond"):
            tests = enumerate(getattr(claim, part))
            texts |= {f"{part}.{i}.what": test.what for i, test in tests}
        texts |= {f"changes.{i}.reason": c.reason for i, c in enumerate(claim.changes)}
        for key, text in texts.items():
            require_typeset(text, f"{folder / 'claims.yaml'}: {name}.{key}")


def _study(study: Study) -> Row:
    settings = study.settings
    return {
        "scenes": len(study.scenes),
        "experiments": len(study.experiments),
        "threshold": settings.sensitivity.threshold,
        "perturbation": settings.sensitivity.reference,
        "seeds": len(settings.sensitivity.seeds),
        "noise_repetitions": settings.noise.repetitions,
        "repeats": settings.timing.repeats,
        "timed_frames": settings.timing.frames,
        "processes": settings.frame_times.processes,
        "blowup_extent": settings.blowup_extent,
        "ranks": ", ".join(str(r) for r in settings.ranks),
        "wrong": settings.stability.wrong,
        "left": settings.stability.left,
        "tolerance": settings.iterations.tolerance,
        "continuous_tolerance": settings.alternatives.continuous.tolerance,
        "compared_frames": settings.alternatives.compared,
        "opponent_frames": settings.alternatives.frames,
    }


def _scene(study: Study, name: str) -> Row:
    config, scene = study.scenes[name], study.bound[name]
    weights = {e.effect: e.weight for e in config.effects if isinstance(e, GroupConfig)}
    return {
        "scene": name,
        "groups": ", ".join(f"{group} ({weights[group]:g})" for group in config.groups),
        "vertices": scene.mesh.vertices,
        "elements": sum(group.elements for group in scene.groups),
        "frames": config.frames,
        "iterations": config.iterations,
        "time_step": config.time_step,
        "vertex_mass": config.vertex_mass,
    }
