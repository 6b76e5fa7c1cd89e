"""What a figure shows: the typed content of config/figures.yaml."""

from pathlib import Path
from typing import Annotated, Literal

from pydantic import Field

from pdrom.core.errors import ConfigurationError, choices
from pdrom.core.yamlfile import ConfigModel, read_yaml, validate
from pdrom.report.figures.catalogue import FIGURES

Rank = Annotated[int, Field(ge=0)] | Literal["full"]
Fraction = Annotated[float, Field(ge=0.0, le=1.0)]
Split = Literal["train", "test", "heldout"]


class FigureSpec(ConfigModel):
    """One figure. Whatever a configuration does not hold is left out of the picture.

    number : number in the paper that is reproduced; None for a figure of this study
    scenes, groups, methods : what is drawn, in this order; an empty list means all there is
    ranks : basis sizes, ``full`` is the full numerical rank
    frames : instants as fractions of the run (1 is its last frame)
    azimuth, elevation : camera, degrees; y points up
    count : how many modes or iterations are drawn
    published : scene -> experiment of the published code whose output is drawn beside ours
    perturbation, threshold : relative size of the perturbed start, and the spread that ends the
        horizon (sensitivity only)
    """

    number: Annotated[int, Field(ge=1)] | None = None
    title: Annotated[str, Field(min_length=3)]
    caption: Annotated[str, Field(min_length=20)]
    scenes: tuple[str, ...] = ()
    groups: tuple[str, ...] = ()
    methods: tuple[str, ...] = ()
    ranks: tuple[Rank, ...] = ()
    frames: tuple[Fraction, ...] = (0.1, 0.5, 0.9)
    splits: tuple[Split, ...] = ("train", "test", "heldout")
    columns: Annotated[int, Field(ge=1, le=6)] = 3
    count: Annotated[int, Field(ge=1, le=12)] = 6
    azimuth: Annotated[float, Field(ge=-180.0, le=180.0)] = 30.0
    elevation: Annotated[float, Field(ge=-90.0, le=90.0)] = 20.0
    published: dict[str, str] = Field(default_factory=dict)
    perturbation: Annotated[float, Field(gt=0.0, lt=1.0)] = 1e-10
    threshold: Annotated[float, Field(gt=0.0)] = 1e-3


def load_figures(path: Path | str) -> dict[str, FigureSpec]:
    """Figures of a configuration file, by name, in the order of the file.

    Raises
    ------
    ConfigurationError
        Unknown figure name or key, a value outside its range, or a scene that config/scenes (beside
        the file) does not hold.
    """
    path = Path(path)
    content = read_yaml(path)
    if not isinstance(content, dict):
        raise ConfigurationError(f"{path}: a mapping of figure names is required")
    figures = {}
    for name, entry in content.items():
        if name not in list(FIGURES):
            raise ConfigurationError(f"{path}: unknown figure '{name}'{choices(name, FIGURES)}")
        figures[name] = validate(FigureSpec, entry, f"{path}: {name}")
        _check_scenes(path, name, figures[name])
    return figures


def _check_scenes(path: Path, name: str, spec: FigureSpec) -> None:
    folder = path.parent / "scenes"
    if not folder.is_dir():
        return
    known = sorted(p.stem for p in folder.glob("*.yaml"))
    for scene in (*spec.scenes, *spec.published):
        if scene not in known:
            raise ConfigurationError(
                f"{path}: {name}.scenes = '{scene}': no such scene{choices(scene, known)}"
            )
