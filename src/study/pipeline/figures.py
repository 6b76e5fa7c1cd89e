"""Jobs of the figures."""

from dataclasses import dataclass
from pathlib import Path

from pdrom.core.errors import ConfigurationError, choices
from pdrom.model.constraints.base import ConstraintGroup
from pdrom.model.effects import EFFECTS
from pdrom.reduction.method import load_methods
from study.artifact.markup import filled, to_plain, to_rst, to_tex
from study.artifact.paths import Place
from study.artifact.reads import Labels, Setting
from study.figures.kit.catalogue import declarations, load_choices
from study.figures.kit.declaration import Declaration, Order
from study.figures.kit.holdings import GroupHolding, Holdings, MethodHolding, SceneHolding
from study.figures.kit.options import Options
from study.paper.figure_numbers import Numbers, figure_numbers
from study.pipeline.contents import SOME, labels_of
from study.pipeline.fingerprint import closure, fingerprint
from study.pipeline.full import is_full
from study.pipeline.resolve import Job, Resolver
from study.pipeline.study import Study

# Output of the preprint's published code, drawn beside ours and never used as our result.
PUBLISHED = Path("config/reference/published_code")
ELEMENTS = "study.figures.kit.elements"
UNNUMBERED = "–"


@dataclass(frozen=True)
class FigureJob:
    """One figure: its job, what is drawn, and how it is presented.

    label : name, with its numbers in the manuscript and in the preprint
    category, labels : where the report lists it: the preprint's figures by their number there, then
        this study's
    rst : title and caption for the report, in which no sign has a meaning
    tex : title and caption for the manuscript
    """

    job: Job
    order: Order
    label: str
    category: str
    labels: dict[str, str]
    rst: str
    tex: str

    @property
    def pdf(self) -> str:
        """File of the PDF."""
        return self.job.outputs["pdf"]

    @property
    def png(self) -> str:
        """File of the PNG."""
        return self.job.outputs["png"]


class _Sources(Resolver):
    """Files for the scenes, groups and methods that the options of a figure choose."""

    def __init__(self, study: Study, results: str, holdings: Holdings, options: Options) -> None:
        super().__init__(study, results)
        self._holdings, self._options = holdings, options

    def files(self, place: Place, labels: Labels) -> list[str]:
        """Paths of a kind in the chosen experiments."""
        chosen = self._holdings.experiments(self._options)
        held = labels_of(self.study, place)
        return [place.at(self.results, **e) for e in held if (e["scene"], e["group"]) in chosen]

    def chosen(self, place: Place, first: bool) -> list[str]:
        """Paths of a kind for the chosen experiments and methods, or for the first of each."""
        paths = list(self._holdings.files(place, self._options, self.results, first))
        if place not in SOME:
            return paths
        held = {place.at(self.results, **each) for each in SOME[place](self.study)}
        return [path for path in dict.fromkeys(paths) if path in held]

    def published(self, name: str) -> list[str]:
        """Table of the published code, where the options ask for one."""
        return [str(PUBLISHED / f"{name}.csv")] if self._options.names("published") else []


def figure_jobs(study: Study, results: str) -> dict[str, FigureJob]:
    """Every figure of ``study`` by name, with its paths below the folder ``results``.

    Raises
    ------
    ConfigurationError
        A fault in config/figures.yaml: an unknown figure, key, scene, group or method, or a value
        outside its range.
    PaperError
        A section of the manuscript has no file.
    """
    folder = study.root / "config"
    chosen = load_choices(folder / "figures.yaml")
    _check_names(chosen, folder)
    holdings, full = holdings_of(study), is_full(study)
    numbers = figure_numbers(study.root)
    return {
        name: _job(name, declared, numbers[name], chosen[name], study, holdings, full, results)
        for name, declared in declarations().items()
    }


def holdings_of(study: Study) -> Holdings:
    """Collect the scenes, methods and groups of a study that figures draw."""
    groups = [name for name in EFFECTS if issubclass(EFFECTS.load(name), ConstraintGroup)]
    held = {group for scene in study.scenes.values() for group in scene.groups}
    return Holdings(
        scenes={
            name: SceneHolding(mesh=study.mesh_of(name), groups=tuple(scene.reduce))
            for name, scene in study.scenes.items()
        },
        methods={
            name: MethodHolding(title=method.title, basis=method.basis_id, rows=method.rows)
            for name, method in study.methods.items()
        },
        groups={
            name: GroupHolding(
                place=place, cells=EFFECTS.load(name).cells, unit=EFFECTS.load(name).unit
            )
            for place, name in enumerate(groups)
            if name in held
        },
    )


def _job(
    name: str,
    declared: Declaration,
    numbers: Numbers,
    options: Options,
    study: Study,
    holdings: Holdings,
    full: bool,
    results: str,
) -> FigureJob:
    held = holdings.chosen(options)
    sources = _Sources(study, results, held, options)
    keys = [read.key for read in declared.reads.values() if isinstance(read, Setting)]
    settings = {key: sources.value(key, {}) for key in keys}
    title, caption = (filled(text, settings) for text in (declared.title, declared.caption))
    published = bool(options.names("published"))
    order = Order(
        title=to_plain(title),
        options=options.model_dump(mode="json"),
        holdings=held,
        settings=settings,
        published=str(PUBLISHED) if published else None,
        full=full,
    )
    groups = dict.fromkeys(group for _, group in held.experiments(options))
    # where elements are drawn on the mesh, the group's class says where they lie
    on_mesh = ELEMENTS in closure(declared.module)
    classes = [EFFECTS[group] for group in groups if on_mesh]
    job = Job(
        declared,
        {},
        declared.inputs(sources, {}),
        {kind: place.at(results) for kind, place in declared.writes.items()},
        {"order": order.model_dump(mode="json")},
        "",
        fingerprint(declared.module, *classes),
    )
    return FigureJob(
        job=job,
        order=order,
        label=numbers.label(name),
        category="Figures of this study" if numbers.preprint is None else "Figures of the preprint",
        labels=_labels(name, numbers, order.title),
        rst=f"**{to_rst(title)}.** {to_rst(caption)}",
        tex=f"{to_tex(title)}. {to_tex(caption)}",
    )


def _labels(name: str, numbers: Numbers, title: str) -> dict[str, str]:
    """Columns of the report, which is sorted by the first one."""
    own = {"paper": numbers.manuscript or UNNUMBERED}
    if numbers.preprint is None:
        return {"name": name, **own, "title": title}
    return {"preprint": str(numbers.preprint), **own, "name": name, "title": title}


def _check_names(chosen: dict[str, Options], folder: Path) -> None:
    known = {"methods": load_methods(folder / "methods.yaml"), "groups": EFFECTS}
    for figure, options in chosen.items():
        for key, names in known.items():
            for name in options.names(key):
                if name not in names:
                    place = f"{folder / 'figures.yaml'}: {figure}.{key} = '{name}'"
                    raise ConfigurationError(f"{place}: unknown{choices(name, names)}")
