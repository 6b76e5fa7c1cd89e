"""Catalogue of the figures: every module of the package declares one."""

from collections.abc import Iterator
from functools import cache
from importlib import import_module
from pathlib import Path
from pkgutil import iter_modules

from pdrom.core.errors import ConfigurationError, choices
from pdrom.core.yamlfile import read_yaml, validate
from study.figures import kit
from study.figures.kit.declaration import Declaration
from study.figures.kit.options import Options

PACKAGE = kit.__name__.rpartition(".")[0]


@cache
def declarations() -> dict[str, Declaration]:
    """Every figure by name: those of the preprint by their number there, then the others by name.

    Raises
    ------
    ConfigurationError
        A module does not declare one figure of its own name, or two figures have the same number.
    """
    found = dict(_declared())
    numbers = [d.number for d in found.values() if d.number is not None]
    for number in numbers:
        if numbers.count(number) > 1:
            raise ConfigurationError(f"{PACKAGE}: two figures have the number {number}")
    last = len(found) + max(numbers, default=0)
    return dict(sorted(found.items(), key=lambda item: (item[1].number or last, item[0])))


def _declared() -> Iterator[tuple[str, Declaration]]:
    folder = str(Path(kit.__file__).parents[1])
    for module in iter_modules([folder]):
        if module.ispkg:
            continue
        place = f"{PACKAGE}.{module.name}"
        values = vars(import_module(place)).values()
        found = [v for v in values if isinstance(v, Declaration) and v.module == place]
        if [declared.name for declared in found] != [module.name]:
            raise ConfigurationError(f"{place}: must declare one figure, called {module.name}")
        yield module.name, found[0]


def declaration(name: str) -> Declaration:
    """Figure ``name``; ConfigurationError, with what is allowed, if there is none."""
    known = declarations()
    if name not in known:
        raise ConfigurationError(f"unknown figure '{name}'{choices(name, known)}")
    return known[name]


def load_choices(path: Path | str) -> dict[str, Options]:
    """Options of every figure: its defaults, and what ``path`` (config/figures.yaml) chooses.

    Raises
    ------
    ConfigurationError
        Unknown figure, a key that the figure does not have, a value outside its range, or a scene
        that config/scenes (next to the file) does not hold.
    """
    path = Path(path)
    content = read_yaml(path)
    content = {} if content is None else content
    if not isinstance(content, dict):
        raise ConfigurationError(f"{path}: a mapping of figure names is required")
    known = declarations()
    for name in content:
        if name not in known:
            raise ConfigurationError(f"{path}: unknown figure '{name}'{choices(name, known)}")
    chosen = {
        name: validate(figure.options, content.get(name, {}), f"{path}: {name}")
        for name, figure in known.items()
    }
    _check_scenes(path, chosen)
    return chosen


def _check_scenes(path: Path, chosen: dict[str, Options]) -> None:
    folder = path.parent / "scenes"
    if not folder.is_dir():
        return
    known = sorted(p.stem for p in folder.glob("*.yaml"))
    for name, options in chosen.items():
        for scene in (*options.names("scenes"), *options.names("published")):
            if scene not in known:
                raise ConfigurationError(
                    f"{path}: {name}.scenes = '{scene}': no such scene{choices(scene, known)}"
                )
