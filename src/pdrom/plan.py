"""The plan that the workflow rules ask: file names, parameters and code fingerprints."""

import os
import sys
from collections.abc import Sequence
from functools import cached_property
from hashlib import sha256
from pathlib import Path
from typing import Any

from pdrom.claims import load_claims
from pdrom.config import Study, StudySettings, require_scenes
from pdrom.effects import EFFECTS
from pdrom.errors import ConfigurationError, PdromError, choices
from pdrom.figures import FIGURES, FigureSpec, Holdings, figure_inputs, load_figures
from pdrom.figures.sources import PUBLISHED
from pdrom.fingerprint import fingerprint
from pdrom.ladder import LadderSpec, load_ladder
from pdrom.mesh.config import MeshFile
from pdrom.method import MethodSpec, load_methods
from pdrom.paper.textables import TEX_TABLES

RESULTS = "results"
REFERENCE_BASIS = "none-none-vectorised"
TABLES = (
    "singular_values", "reconstruction_error", "reduced_reruns", "accuracy_cost", "local_share",
    "sensitivity",
    "ladder", "heldout_reruns", "claims",
)  # fmt: skip


def load_plan(config: dict[str, Any], root: Path, files: Sequence[str | Path] = ()) -> "Plan":
    """Plan of a configuration; a faulty one ends the process with one line, before any job.

    Parameters
    ----------
    files : where the configuration came from, for the messages
    """
    names = [os.path.relpath(path, root) for path in files] or ["config/default.yaml"]
    source = f"configuration ({', '.join(sorted(set(names)))})"
    try:
        plan = Plan(Study.load(config, root, source))
        plan.check()
        return plan
    except PdromError as error:
        sys.exit(f"pdrom: {error}")


class Plan:
    """Everything that depends on the configuration and is needed to write the rules."""

    def __init__(self, study: Study) -> None:
        self.study = study
        self.root = study.root

    @property
    def settings(self) -> StudySettings:
        """Checked settings of the study."""
        return self.study.settings

    def check(self) -> None:
        """Read the configuration of figures, ladder and claims, so that a fault shows early."""
        folder = self.root / "config"
        load_claims(folder / "claims.yaml")
        ladder = f"{folder / 'ladder.yaml'}: scenes"
        require_scenes(self.root, self.ladder.scenes, ladder)
        require_scenes(self.root, self.settings.subspace.scenes, "subspace.scenes")
        known = {"methods": load_methods(folder / "methods.yaml"), "groups": EFFECTS}
        for figure, spec in self.figure_specs.items():
            for key, names in known.items():
                for name in getattr(spec, key):
                    if name not in names:
                        place = f"{folder / 'figures.yaml'}: {figure}.{key} = '{name}'"
                        raise ConfigurationError(f"{place}: unknown{choices(name, names)}")

    # Parameters -----------------------------------------------------------------------------

    def scene_config(self, scene: str) -> dict[str, Any]:
        """Plain configuration of a scene; a change of it reruns the scene's jobs."""
        return self._scene_configs[scene]

    @cached_property
    def _scene_configs(self) -> dict[str, dict[str, Any]]:
        return {name: s.model_dump(mode="json") for name, s in self.study.scenes.items()}

    def mesh_config(self, mesh: str) -> dict[str, Any]:
        """Plain configuration of a mesh."""
        return self.study.meshes[mesh].model_dump(mode="json")

    def mesh_file(self, mesh: str) -> list[str]:
        """The file that a mesh is read from, an empty list for one that is generated."""
        config = self.study.meshes[mesh]
        return [config.path] if isinstance(config, MeshFile) else []

    def digest(self, *paths: str) -> str:
        """Checksum of files that people edit.

        Snakemake compares times of files, which a copy, an archive or a wrong clock may set back;
        as a parameter of a rule, the content itself decides.
        """
        files = [self.root / path for path in paths]
        content = b"".join(sha256(f.read_bytes()).digest() for f in files if f.is_file())
        return sha256(content).hexdigest()[:16]

    def method_spec(self, method: str) -> dict[str, Any]:
        """Plain specification of a method."""
        return self._method(method).model_dump(mode="json")

    def method_specs(self) -> dict[str, dict[str, Any]]:
        """Plain specifications of all methods of the study."""
        return {name: self.method_spec(name) for name in self.study.methods}

    def basis_spec(self, basis: str) -> dict[str, Any]:
        """Plain specification of the first method that uses ``basis``."""
        names = [m for m, spec in self.study.methods.items() if spec.basis_id == basis]
        return {k: self.method_spec(names[0])[k] for k in ("weighting", "centring", "layout")}

    def subspace_settings(self) -> dict[str, Any]:
        """Plain settings of the position subspaces; which scenes have them is no parameter."""
        return self.settings.subspace.model_dump(mode="json", exclude={"scenes"})

    def _method(self, method: str) -> MethodSpec:
        return self.study.methods[method]

    # Files ----------------------------------------------------------------------------------

    def mesh_path(self, scene: str) -> str:
        """Mesh file of a scene."""
        return f"{RESULTS}/meshes/{self.study.mesh_of(scene)}.h5"

    def basis_path(self, scene: str, group: str, method: str) -> str:
        """Basis file that a method needs."""
        return f"{RESULTS}/pod/{scene}/{group}/{self._method(method).basis_id}.h5"

    def bases_of(self, scene: str) -> list[str]:
        """All basis files of a scene."""
        groups = self.study.scenes[scene].reduce
        paths = [self.basis_path(scene, g, m) for g in groups for m in self.study.methods]
        return sorted(set(paths))

    def reference_bases(self) -> list[str]:
        """One basis file per experiment, for its singular values: uncentred if there."""
        paths = []
        for scene, group in self.study.experiments:
            ids = [spec.basis_id for spec in self.study.methods.values()]
            chosen = sorted(ids, key=lambda i: (i != REFERENCE_BASIS, ids.index(i)))[0]
            paths.append(f"{RESULTS}/pod/{scene}/{group}/{chosen}.h5")
        return paths

    def samplings_of(self, scene: str) -> list[str]:
        """All sampling files of a scene."""
        return self._per_method("sampling", ".h5", scene)

    def per_experiment(self, stage: str, tail: str) -> list[str]:
        """Files of a stage over all scenes, groups and methods, in configuration order."""
        return [p for scene in self.study.scenes for p in self._per_method(stage, tail, scene)]

    def per_scene(self, stage: str, tail: str) -> list[str]:
        """Files of a stage over all scenes; ``tail`` follows the scene's name."""
        return [f"{RESULTS}/{stage}/{scene}{tail}" for scene in self.study.scenes]

    def hyper(self, tail: str) -> list[str]:
        """Files of the position subspaces over the scenes that have them."""
        scenes = [s for s in self.study.scenes if s in self.settings.subspace.scenes]
        return [f"{RESULTS}/hyper/{scene}/{tail}" for scene in scenes]

    def hyper_of(self, scene: str) -> list[str]:
        """The models of one scene, an empty list if it has none."""
        path = f"{RESULTS}/hyper/{scene}/models.h5"
        return [path] if path in self.hyper("models.h5") else []

    def _per_method(self, stage: str, tail: str, scene: str) -> list[str]:
        return [
            f"{RESULTS}/{stage}/{scene}/{group}/{method}{tail}"
            for group in self.study.scenes[scene].reduce
            for method in self.study.methods
        ]

    @property
    def tables(self) -> list[str]:
        """All tables."""
        return [f"{RESULTS}/tables/{name}.csv" for name in TABLES]

    # Ladder ---------------------------------------------------------------------------------

    @cached_property
    def ladder(self) -> LadderSpec:
        """Ladder of config/ladder.yaml."""
        return load_ladder(self.root / "config" / "ladder.yaml")

    def ladder_rungs(self) -> dict[str, Any]:
        """Plain ladder; which scenes climb it is no parameter of one climb."""
        return {**self.ladder.model_dump(mode="json"), "scenes": []}

    def ladder_files(self) -> list[str]:
        """Files of the scenes that climb the ladder and are in this configuration."""
        pairs = [(s, g) for s, g in self.study.experiments if s in self.ladder.scenes]
        return [f"{RESULTS}/ladder/{scene}/{group}.csv" for scene, group in pairs]

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
        return fingerprint("pdrom.stages.figures", FIGURES.module(figure))

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

    def scene_code(self, stage: str, scene: str) -> str:
        """Fingerprint of a stage together with the effects that a scene lists."""
        return fingerprint(stage, *self.study.scenes[scene].modules)
