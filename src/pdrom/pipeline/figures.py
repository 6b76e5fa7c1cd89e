"""What the rules of the figures need from a study."""

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from pdrom.core.errors import ConfigurationError, choices
from pdrom.core.paths import FIGURE, FIGURE_PICTURE, TABLE
from pdrom.core.reads import Chosen, Every, Published, Setting, TableOf
from pdrom.model.constraints.base import ConstraintGroup
from pdrom.model.effects import EFFECTS
from pdrom.pipeline.fingerprint import closure, fingerprint
from pdrom.pipeline.full import is_full
from pdrom.pipeline.holdings import labels_of
from pdrom.pipeline.study import Study
from pdrom.reduction.method import load_methods
from pdrom.report.drawing import Order
from pdrom.report.figure_numbers import Numbers, figure_numbers
from pdrom.report.figures.kit.catalogue import declarations, load_choices, modules
from pdrom.report.figures.kit.declaration import Declaration
from pdrom.report.figures.kit.holdings import GroupHolding, Holdings, MethodHolding, SceneHolding
from pdrom.report.figures.kit.options import Options
from pdrom.report.words.markup import filled, to_plain, to_rst, to_tex

# Output of the preprint's published code, drawn beside ours and never used as our result.
PUBLISHED = Path("config/reference/published_code")
ELEMENTS = "pdrom.report.figures.kit.elements"
UNNUMBERED = "–"


@dataclass(frozen=True)
class FigureJob:
    """One figure: files that it reads and writes, what is drawn, and how it is presented.

    label : name, with its numbers in the manuscript and in the preprint
    category, labels : where the report lists it: the preprint's figures by their number there, then
        this study's
    rst : title and caption for the report, in which no sign has a meaning
    tex : title and caption for the manuscript
    code : fingerprint of the code that draws it
    """

    inputs: list[str]
    pdf: str
    png: str
    log: str
    order: Order
    label: str
    category: str
    labels: dict[str, str]
    rst: str
    tex: str
    code: str


def figure_jobs(study: Study, results: str) -> dict[str, FigureJob]:
    """Every figure by name, with its paths below the folder ``results``.

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
    """What a study holds of the things that figures draw."""
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
    settings = {r.key: _setting(study, r.key) for r in declared.reads if isinstance(r, Setting)}
    title, caption = (filled(text, settings) for text in (declared.title, declared.caption))
    published = bool(options.names("published"))
    order = Order(
        name=name,
        title=to_plain(title),
        options=options.model_dump(mode="json"),
        holdings=held,
        settings=settings,
        published=str(PUBLISHED) if published else None,
        full=full,
    )
    groups = dict.fromkeys(group for _, group in held.experiments(options))
    # where elements are drawn on the mesh, the group's class says where they lie
    on_mesh = ELEMENTS in closure(*modules(name))
    classes = [EFFECTS[group] for group in groups if on_mesh]
    return FigureJob(
        inputs=list(dict.fromkeys(_inputs(declared, options, held, study, results))),
        pdf=FIGURE.at(results, name=name),
        png=FIGURE_PICTURE.at(results, name=name),
        log=f"{results}/logs/figures/{name}.log",
        order=order,
        label=numbers.label(name),
        category="Figures of this study" if numbers.preprint is None else "Figures of the preprint",
        labels=_labels(name, numbers, order.title),
        rst=f"**{to_rst(title)}.** {to_rst(caption)}",
        tex=f"{to_tex(title)}. {to_tex(caption)}",
        code=fingerprint("pdrom.report.drawing", *modules(name), *classes),
    )


def _labels(name: str, numbers: Numbers, title: str) -> dict[str, str]:
    """Columns of the report, which is sorted by the first one."""
    own = {"main.pdf": str(numbers.manuscript or UNNUMBERED)}
    if numbers.preprint is None:
        return {"name": name, **own, "title": title}
    return {"preprint": str(numbers.preprint), **own, "name": name, "title": title}


def _inputs(
    declared: Declaration, options: Options, holdings: Holdings, study: Study, results: str
) -> Iterator[str]:
    chosen = holdings.experiments(options)
    for read in declared.reads:
        match read:
            case TableOf():
                yield TABLE.at(results, name=read.name)
            case Chosen():
                yield from holdings.files(read.place, options, results, read.first)
            case Every(place):
                for labels in labels_of(study, place):
                    if (labels["scene"], labels["group"]) in chosen:
                        yield place.at(results, **labels)
            case Published() if options.names("published"):
                yield str(PUBLISHED / f"{read.name}.csv")


def _setting(study: Study, key: str) -> float:
    """Value of the configuration by its key."""
    value: object = study.settings
    for part in key.split("."):
        value = getattr(value, part)
    assert isinstance(value, int | float), f"{key} is no number"
    return value


def _check_names(chosen: dict[str, Options], folder: Path) -> None:
    known = {"methods": load_methods(folder / "methods.yaml"), "groups": EFFECTS}
    for figure, options in chosen.items():
        for key, names in known.items():
            for name in options.names(key):
                if name not in names:
                    place = f"{folder / 'figures.yaml'}: {figure}.{key} = '{name}'"
                    raise ConfigurationError(f"{place}: unknown{choices(name, names)}")
