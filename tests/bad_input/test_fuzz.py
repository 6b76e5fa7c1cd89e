"""Mutated configurations are accepted or refused with a named error.

Every example runs with little memory to spare, so that an unnecessary allocation fails.
``PDROM_EXAMPLES=1000 ./reproduce test tests/bad_input`` tries more examples.
"""

import copy
import resource
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
import yaml
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from bad_input import project as small
from pdrom.core.errors import PdromError

SPARE_BYTES = 2_000_000_000
FILES = ("methods", "claims")
# A scene with one entry of every kind, so that every key can be mutated.
RICH_SCENE = """\
name: small
title: One of everything
mesh: {kind: cloth, rows: 5, columns: 4, plane: xz, extent: 1.0, lift: 2.0, wave: 0.1}
time_step: 0.016
iterations: 3
frames: 8
vertex_mass: 10.0
effects:
  - {effect: gravity, acceleration: [0.0, -9.81, 0.0]}
  - {effect: damping, rate: 1.0}
  - {effect: floor, height: 0.0}
  - {effect: kick, speed: 0.1, seed: 1, axes: [x, y]}
  - {effect: pins, select: [0, 1], start: 0, until: 4}
  - {effect: translate, select: right, offset: [0.1, 0.0, 0.0], over: 2, until: 4}
  - {effect: rotate, select: [2], axis: x, degrees: 30.0, over: 3, start: 1}
  - {effect: poke, amplitude: 0.1, axis: z, over: 2, rest: 1, count: 1, avoid: [left, right, [7]]}
  - {effect: bending, weight: 1.0}
  - {effect: spring, weight: 1.0e+5}
  - {effect: strain, weight: 1.0e+3, minimum: 0.9, maximum: 1.1}
reduce:
  spring: {train: 4}
  strain: {train: 3}
held_out: {frames_factor: 1.25, carry: 0.1, kick: 0.5, kick_axes: [x], seed: 2}
"""
BAR = small.with_mesh("{kind: bar, nx: 4, ny: 3, nz: 3, extent: 1.0}")
BAR_SCENE = (
    small.SMALL_SCENE.replace(*BAR)
    .replace("effect: spring, weight", "effect: tetrahedron_strain, minimum: 0.9, weight")
    .replace("  spring:", "  tetrahedron_strain:")
)
FILE = small.with_mesh(f"{{kind: file, path: {small.MESH}, scale: 1.0}}")
FILE_SCENE = small.SMALL_SCENE.replace(*FILE)
VALID = small.SMALL_SCENE.encode()

EXTREME = st.sampled_from(
    [None, True, False, 0, 1, -1, 2, 1999, 2**31, 2**64, -(2**64), 10**400, 0.0, -0.0, 0.5, 1e-320,
     1e-5, 1e300, -1e300, float("nan"), float("inf"), float("-inf"), "", " ", "full", "x", "1e6",
     "../x", "/etc/passwd", "a\0b", "ä\n", "{x}", "x" * 5000, [], [[]], [0], ["x"], {}, {"x": 1},
     {"effect": "spring"}, [{}], list(range(300))]
)  # fmt: skip
VALUES = EXTREME | st.integers() | st.floats() | st.text(max_size=8)
KEYS = st.text(max_size=8) | st.integers(0, 3) | st.none() | st.booleans()


def places(data: Any, path: tuple = ()) -> Iterator[tuple]:
    """Paths of all entries of nested mappings and lists."""
    entries = data.items() if isinstance(data, dict) else enumerate(data)
    for key, value in list(entries) if isinstance(data, (dict, list)) else ():
        yield (*path, key)
        if isinstance(value, (dict, list)):
            yield from places(value, (*path, key))


@st.composite
def mutated(draw: Callable, data: Any) -> Any:
    """``data`` with one to three entries deleted, renamed, repeated, swapped or replaced."""
    result = copy.deepcopy(data)
    for _ in range(draw(st.integers(1, 3))):
        paths = list(places(result))
        if not paths:
            return result
        path = draw(st.sampled_from(paths))
        owner = result
        for key in path[:-1]:
            owner = owner[key]
        _mutate(draw, owner, path[-1])
    return result


def _mutate(draw: Callable, owner: Any, key: Any) -> None:
    action = draw(st.sampled_from(["delete", "rename", "repeat", "wrap", "replace", "replace"]))
    if action == "delete":
        del owner[key]
    elif action == "rename" and isinstance(owner, dict):
        owner[draw(KEYS)] = owner.pop(key)
    elif action == "repeat" and isinstance(owner, list):
        owner.append(copy.deepcopy(owner[key]))
    elif action == "wrap":
        owner[key] = [owner[key]]
    else:
        # copied, because a mutation must not change the list that hypothesis draws from
        owner[key] = copy.deepcopy(draw(VALUES))


@pytest.fixture(scope="module")
def project(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A project; each example overwrites one of its files."""
    return small.make_project(tmp_path_factory.mktemp("fuzz"), {})


@pytest.fixture(autouse=True)
def little_memory() -> Iterator[None]:
    """Limit the memory of the process to `SPARE_BYTES` more than it uses now."""
    before = resource.getrlimit(resource.RLIMIT_AS)
    used = int(Path("/proc/self/statm").read_text().split()[0]) * resource.getpagesize()
    resource.setrlimit(resource.RLIMIT_AS, (used + SPARE_BYTES, before[1]))
    yield
    resource.setrlimit(resource.RLIMIT_AS, before)


def accepted_or_named(
    root: Path, path: str = small.SCENE, content: Any = VALID, overrides: dict | None = None
) -> None:
    """Load the project with other content of one file; it may fail only with a named error."""
    original, message = (root / path).read_bytes(), ""
    try:
        text = content if isinstance(content, bytes) else yaml.safe_dump(content).encode()
        (root / path).write_bytes(text)
        small.load_project(root, overrides)
    except PdromError as error:
        message = str(error)
    finally:
        (root / path).write_bytes(original)
    assert "\n" not in message
    assert len(message) < 2500


FUZZ = settings(suppress_health_check=list(HealthCheck))
SCENES = [RICH_SCENE, BAR_SCENE, FILE_SCENE]


@FUZZ
@given(data=st.data())
@pytest.mark.parametrize("text", SCENES, ids=["rich", "bar", "file"])
def test_mutated_scenes_are_read_or_refused(project: Path, text: str, data: st.DataObject) -> None:
    accepted_or_named(project, small.SCENE, data.draw(mutated(yaml.safe_load(text))))


@pytest.mark.parametrize("text", [small.SMALL_SCENE, *SCENES])
def test_the_scenes_are_valid_before_they_are_mutated(tmp_path: Path, text: str) -> None:
    plan = small.load_project(small.make_project(tmp_path, {small.SCENE: text}))
    assert plan.study.sizes["small"][0] > 0


@FUZZ
@given(data=st.data())
@pytest.mark.parametrize("section", [None, "ladder", "hard_cases"])
def test_mutated_studies_are_read_or_refused(
    project: Path, section: str | None, data: st.DataObject
) -> None:
    full = yaml.safe_load((small.CONFIG / "default.yaml").read_text(encoding="utf-8"))
    own = yaml.safe_load(small.SMALL_STUDY) | {
        "subspace": {**full["subspace"], "scenes": ["small"]}
    }
    base = {section: full[section]} if section else full | own
    accepted_or_named(project, overrides=data.draw(mutated(base)))


@FUZZ
@given(data=st.data())
@pytest.mark.parametrize("name", FILES)
def test_mutated_files_are_read_or_refused(project: Path, name: str, data: st.DataObject) -> None:
    path = f"config/{name}.yaml"
    content = yaml.safe_load((project / path).read_text(encoding="utf-8"))
    accepted_or_named(project, path, data.draw(mutated(content)))


@FUZZ
@given(content=st.binary(max_size=200) | st.text(max_size=60).map(str.encode))
@pytest.mark.parametrize("path", [small.STUDY, small.SCENE])
def test_files_of_any_bytes_are_read_or_refused(project: Path, path: str, content: bytes) -> None:
    accepted_or_named(project, path, content)
