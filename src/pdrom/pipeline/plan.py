"""The plan that the workflow rules ask: file names, parameters and code fingerprints."""

import os
import sys
from collections.abc import Sequence
from functools import cached_property
from pathlib import Path
from typing import Any

from pdrom.core.errors import ConfigurationError, PdromError, choices
from pdrom.core.logs import planning_log
from pdrom.experiments.hard_cases.expectations import load_expectations
from pdrom.model.effects import EFFECTS
from pdrom.pipeline.fingerprint import fingerprint
from pdrom.pipeline.jobs import Jobs, digest
from pdrom.pipeline.scenes import require_scenes
from pdrom.pipeline.study import Study, StudySettings
from pdrom.pipeline.tables import Tables
from pdrom.reduction.method import MethodSpec, load_methods
from pdrom.report.claims import load_claims
from pdrom.report.figures import FIGURES, FigureSpec, Holdings, figure_inputs, load_figures
from pdrom.report.figures.sources import PUBLISHED
from pdrom.report.paper.textables import TEX_TABLES

RESULTS = "results"


def load_plan(
    config: dict[str, Any],
    root: Path,
    files: Sequence[str | Path] = (),
    results: str = RESULTS,
    quiet: bool = False,
) -> "Plan":
    """Plan of a configuration; a faulty one ends the process with one line, before any job.

    Parameters
    ----------
    files : where the configuration came from, for the messages
    results : folder of its results
    quiet : whether warnings are dropped, see `pdrom.core.logs.planning_log`
    """
    names = [os.path.relpath(path, root) for path in files] or ["config/default.yaml"]
    source = f"configuration ({', '.join(sorted(set(names)))})"
    try:
        with planning_log(quiet):
            plan = Plan(Study.load(config, root, source), results)
            plan.check()
        return plan
    except PdromError as error:
        sys.exit(f"pdrom: {error}")


class Plan:
    """Everything that depends on the configuration and is needed to write the rules."""

    def __init__(self, study: Study, results: str = RESULTS) -> None:
        self.study = study
        self.root = study.root
        self.results = results
        self.jobs = Jobs(study, results)
        self.tables = Tables(study, results)

    @property
    def settings(self) -> StudySettings:
        """Checked settings of the study."""
        return self.study.settings

    def check(self) -> None:
        """Read every file of the configuration, so that a fault shows early."""
        folder = self.root / "config"
        load_claims(folder / "claims.yaml")
        load_expectations(folder / "hard_cases.yaml")
        self._check_scenes(folder)
        self._check_figures(folder)
        self.jobs.check()

    def _check_scenes(self, folder: Path) -> None:
        settings = self.settings
        named = {
            f"{folder / 'ladder.yaml'}: scenes": self.study.ladder.scenes,
            f"{folder / 'subspace_ablation.yaml'}: scenes": self.study.ablation.scenes,
            "subspace.scenes": settings.subspace.scenes,
            "scaling.scenes": tuple(settings.scaling.scenes),
            "stability.scenes": settings.stability.scenes,
            "guard.cases": tuple(case.scene for case in settings.guard.cases),
        }
        for place, scenes in named.items():
            require_scenes(self.root, scenes, place)

    def _check_figures(self, folder: Path) -> None:
        known = {"methods": load_methods(folder / "methods.yaml"), "groups": EFFECTS}
        for figure, spec in self.figure_specs.items():
            for key, names in known.items():
                for name in getattr(spec, key):
                    if name not in names:
                        place = f"{folder / 'figures.yaml'}: {figure}.{key} = '{name}'"
                        raise ConfigurationError(f"{place}: unknown{choices(name, names)}")

    # Parameters -----------------------------------------------------------------------------

    def digest(self, *paths: str) -> str:
        """See `pdrom.pipeline.jobs.digest`."""
        return digest(self.root, *paths)

    def method_spec(self, method: str) -> dict[str, Any]:
        """Plain specification of a method."""
        return self._method(method).model_dump(mode="json")

    def _method(self, method: str) -> MethodSpec:
        return self.study.methods[method]

    # Figures --------------------------------------------------------------------------------

    @cached_property
    def figure_specs(self) -> dict[str, FigureSpec]:
        """Figures of config/figures.yaml, with the floor's settings of this study."""
        floor = self.settings.sensitivity
        update = {"perturbation": floor.reference, "threshold": floor.threshold}
        figures = load_figures(self.root / "config" / "figures.yaml")
        return {name: spec.model_copy(update=update) for name, spec in figures.items()}

    @cached_property
    def _holdings(self) -> Holdings:
        return Holdings.of_study(self.study)

    @property
    def figures(self) -> list[str]:
        """PDF of every figure."""
        return [f"{RESULTS}/figures/{name}.pdf" for name in self.figure_specs]

    def figure_spec(self, figure: str) -> dict[str, Any]:
        """Plain specification of a figure."""
        return self.figure_specs[figure].model_dump(mode="json")

    def figure_label(self, figure: str) -> str:
        """Number in the paper and name, for the report."""
        number = self.figure_specs[figure].number
        return f"{number} {figure}" if number else figure

    def figure_holdings(self, figure: str) -> dict[str, Any]:
        """What this configuration holds, as plain data."""
        return self._holdings.model_dump(mode="json")

    def figure_inputs(self, figure: str) -> list[str]:
        """Files that a figure reads."""
        spec = self.figure_specs[figure]
        published = sorted(map(str, PUBLISHED.glob("*.csv"))) if spec.published else []
        return published + figure_inputs(figure, spec, self._holdings, RESULTS)

    def figure_code(self, figure: str) -> str:
        """Fingerprint of the code that draws a figure."""
        return fingerprint("pdrom.report.drawing", FIGURES[figure])

    # Manuscript -----------------------------------------------------------------------------

    @property
    def paper_inputs(self) -> list[str]:
        """Generated files that main.tex reads."""
        return ["macros.tex", "main.bbl", *(f"{name}.tex" for name in TEX_TABLES)]

    def facts(self) -> dict[str, list[dict[str, Any]]]:
        """Facts of the configuration that the manuscript states, as tables."""
        settings = self.settings
        study = {
            "scenes": len(self.study.scenes),
            "experiments": len(self.study.experiments),
            "threshold": settings.sensitivity.threshold,
            "perturbation": settings.sensitivity.reference,
            "seeds": len(settings.sensitivity.seeds),
            "repeats": settings.timing.repeats,
            "timed_frames": settings.timing.frames,
            "blowup_extent": settings.blowup_extent,
            "ranks": ", ".join(str(r) for r in settings.ranks),
            "wrong": settings.stability.wrong,
            "left": settings.stability.left,
            "guard_action": settings.guard.action,
            "guard_margin": settings.guard.margin,
            "guard_extent": settings.guard.extent,
            "guard_rise": settings.guard.rise,
            "tolerance": settings.iterations.tolerance,
        }
        methods = [{"method": m, **self.method_spec(m)} for m in self.study.methods]
        scenes = [self._scene_facts(name) for name in self.study.scenes]
        return {"study": [study], "methods": methods, "scenes": scenes}

    def _scene_facts(self, name: str) -> dict[str, Any]:
        config = self.study.scenes[name]
        scene = self.study.bound[name]
        weights = {e.effect: e.weight for e in config.effects if e.effect in config.groups}
        return {
            "scene": name,
            "groups": ", ".join(f"{g} ({weights[g]:g})" for g in config.groups),
            "vertices": scene.mesh.vertices,
            "elements": sum(group.elements for group in scene.groups),
            "frames": config.frames,
            "iterations": config.iterations,
            "time_step": config.time_step,
            "vertex_mass": config.vertex_mass,
        }

    # Code -----------------------------------------------------------------------------------

    def code(self, *modules: str) -> str:
        """Fingerprint of the code that a stage runs; a change of it reruns the stage."""
        return fingerprint(*modules)
