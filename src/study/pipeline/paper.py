"""Facts about a study that the manuscript states and that are not results of experiments."""

from types import SimpleNamespace
from typing import Any

from pdrom.model.constraints.base import GroupConfig
from pdrom.model.held_out import HeldOut
from pdrom.view.text import require_typeset
from study.artifact.markup import to_tex
from study.artifact.reads import Labels
from study.figures.kit.declaration import declarations
from study.paper.build import PAGES, Facts
from study.paper.source import source_files
from study.pipeline.folders import DEFAULT
from study.pipeline.study import Study
from study.tables.claims.rules import load_claims
from study.tables.kit.results import FAR

Row = dict[str, Any]


def manuscript(study: Study, labels: Labels) -> SimpleNamespace:
    """Return a namespace whose ``sources`` lists the TeX files of paper and supplement."""
    return SimpleNamespace(sources=source_files(study.root, study.is_own))


def facts(study: Study, labels: Labels) -> Facts:
    """Return configuration facts of ``study``: captions, scenes, methods, settings, page limits."""
    own = study.is_own
    said = [(name, each.words(study.value)) for name, each in declarations().items()]
    return Facts(
        captions={name: f"{to_tex(title)}. {to_tex(text)}" for name, (title, text) in said},
        part=None if study.is_full or own else study.configuration,
        full_study=study.configuration if own else DEFAULT,
        pages={} if own else PAGES,
        tables={
            "study": [_study(study)],
            "methods": [
                {"method": name, **method.model_dump(mode="json")}
                for name, method in study.methods.items()
            ],
            "scenes": [_scene(study, name) for name in study.scenes],
        },
    )


def check_texts(study: Study) -> None:
    """Raise ConfigurationError for a text of ``study`` that figures or TeX cannot typeset."""
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
        "opponent_frames": settings.alternatives.frames,
        "opponent_processes": settings.alternatives.processes,
        "far": FAR,
        "carry": HeldOut().carry,
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
