"""Parts of a study that figures draw, chosen by their options."""

from collections.abc import Mapping

from pdrom.model import constraints
from pdrom.model.effects import EFFECTS
from study.artifact.paths import SUBSPACES
from study.figures.kit.options import Experiment, Options, Reduction
from study.pipeline.contents import labels_of
from study.pipeline.study import Study

Labels = Mapping[str, str]


class Run(Experiment):
    """An experiment with a method."""

    method: str

    @property
    def labels(self) -> dict[str, str]:
        """Labels of its files."""
        return {**super().labels, "method": self.method}


def options(study: Study, labels: Labels) -> Options:
    """Options of the figure of ``labels`` with the scenes that ``study`` holds.

    A list of scenes or methods of which it holds none becomes empty, which means all.
    """
    chosen = study.figures[labels["figure"]]
    update: dict[str, tuple[str, ...]] = {}
    if {*chosen.names("methods")}.isdisjoint(study.methods) and chosen.names("methods"):
        update["methods"] = ()
    if scenes := chosen.names("scenes"):
        update["scenes"] = tuple(scene for scene in scenes if scene in study.scenes)
    return chosen.model_copy(update=update)


def experiments(study: Study, labels: Labels) -> tuple[Experiment, ...]:
    """Reduced groups of ``study`` that a figure's options choose, in the order asked for."""
    chosen = options(study, labels)
    found = []
    for scene in chosen.names("scenes") or tuple(study.scenes):
        config = study.scenes[scene]
        reduced = tuple(config.reduce)
        found += [
            Experiment(
                scene=scene,
                group=group,
                mesh=config.mesh.identifier,
                effects=config.effects,
                only=len(reduced) == 1,
            )
            for group in reduced
        ]
    return tuple(found)


def reductions(study: Study, labels: Labels) -> dict[str, Reduction]:
    """Methods of ``study`` that a figure's options choose, by name, in the order asked for."""
    named = options(study, labels).names("methods") or tuple(study.methods)
    held = {name: study.methods[name] for name in named if name in study.methods}
    return {name: Reduction(title=spec.title, rows=spec.rows) for name, spec in held.items()}


def runs(study: Study, labels: Labels) -> tuple[Run, ...]:
    """Every chosen experiment with every chosen method."""
    methods = reductions(study, labels)
    return tuple(
        Run(**experiment.model_dump(), method=method)
        for experiment in experiments(study, labels)
        for method in methods
    )


def drawn_subspaces(study: Study, labels: Labels) -> tuple[Experiment, ...]:
    """Chosen experiments in scenes of which ``study`` has models in position subspaces."""
    held = {found["scene"] for found in labels_of(study, SUBSPACES)}
    return tuple(each for each in experiments(study, labels) if each.scene in held)


def groups(study: Study, labels: Labels) -> tuple[str, ...]:
    """Names of all constraint groups."""
    return tuple(name for name in EFFECTS if EFFECTS[name].startswith(constraints.__name__))


DERIVED = {
    "options": options,
    "experiments": experiments,
    "reductions": reductions,
    "runs": runs,
    "first_run": lambda study, labels: runs(study, labels)[:1],
    "drawn_subspaces": drawn_subspaces,
    "groups": groups,
}
