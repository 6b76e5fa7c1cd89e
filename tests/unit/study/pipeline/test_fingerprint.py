"""Fingerprints change with everything that can change a result, and with nothing else.

The memory of plans is computed again as soon as one of its dependencies changes.
"""

import ast

import pytest

from bad_input.project import MESH, SCENE, SQUARE, make_project, with_mesh
from pdrom.core.errors import ConfigurationError
from pdrom.model.effects import EFFECTS
from pdrom.reduction.method import SELECTIONS, MethodSpec
from study.pipeline import scenes
from study.pipeline.fingerprint import Memory, closure, digest_of_code, fingerprint


def digest_of_source(text: str, module: str = "") -> str:
    return digest_of_code(ast.parse(text), module)


SOURCE = '''"""Module."""

import os

LIMIT = 3
"""Allowed values."""


class Thing:
    """A thing."""

    size: int = 2
    """Its size."""

    def grow(self, by=1):
        """Grow."""
        return self.size + by  # not in place


def empty():
    """Nothing."""
'''


WORDS = [
    ('"""Module."""\n', ""),
    ('"""Allowed values."""', '"""Limit."""'),
    ('        """Grow."""\n', ""),
    ("  # not in place", ""),
    ("import os\n", "# comment\nimport os\n\n\n"),
    ("self.size + by", "(self.size +\n                by)"),
    ('    """Nothing."""', "    pass"),
]
CODE = [
    ("LIMIT = 3", "LIMIT = 3.0"),
    ("import os", "import sys"),
    ("size: int", "size: float"),
    ("def grow", "def swell"),
    ("return self.size + by", "return 'x'"),
    ("class Thing:", "class Thing(list):"),
]


@pytest.mark.parametrize("edit", [*WORDS, *CODE])
def test_fingerprints_depend_on_code_and_not_on_comments(edit):
    assert edit[0] in SOURCE
    edited = digest_of_source(SOURCE.replace(*edit))
    assert (edited != digest_of_source(SOURCE)) == (edit in CODE)


REGISTRY = """
from pdrom.core.registry import Registry

THINGS = Registry("thing", {"own": "pdrom.here:Own", "other": "pdrom.there:Other"})
"""


@pytest.mark.parametrize(
    ("old", "new", "counts"),
    [
        ('"other": "pdrom.there:Other"', '"other": "pdrom.there:Another"', False),
        ('"own": "pdrom.here:Own"', '"own": "pdrom.here:Other"', True),
        ('"thing"', '"kind"', True),
        ("Registry(", "dict(", True),
    ],
)
def test_fingerprints_ignore_registry_entries_of_other_modules(old, new, counts):
    """Jobs list the entries that they need; entries of the module itself belong to its code."""
    assert old in REGISTRY
    edited = digest_of_source(REGISTRY.replace(old, new), "pdrom.here")
    assert (edited != digest_of_source(REGISTRY, "pdrom.here")) == counts


def test_fingerprints_depend_on_the_attribute_of_a_registry_entry():
    """Two effects of one module."""
    pins, rotate = (fingerprint(EFFECTS[name]) for name in ("pins", "rotate"))
    assert EFFECTS["pins"].partition(":")[0] == EFFECTS["rotate"].partition(":")[0]
    assert pins != rotate
    assert closure(EFFECTS["pins"]) == closure(EFFECTS["pins"].partition(":")[0])


def test_a_method_depends_only_on_the_selection_that_it_names():
    own = {entry.partition(":")[0] for entry in SELECTIONS.values()}
    for name in SELECTIONS:
        method = MethodSpec(title="test", rows="element", selection=name)
        found = closure("pdrom.reduction.sampling.reduction", *method.modules)
        assert own & set(found) == {SELECTIONS[name].partition(":")[0]}
    everything = MethodSpec(title="test", rows="all")
    assert not own & set(closure("pdrom.reduction.sampling.reduction", *everything.modules))


def test_an_unknown_module_is_named():
    with pytest.raises(ConfigurationError, match=r"pdrom\.nothing"):
        fingerprint("pdrom.nothing")


def test_a_fingerprint_covers_imported_modules_and_their_packages():
    """`workflow.test_snakefile` edits their code or words."""
    spring, bending = (f"pdrom.model.constraints.{name}" for name in ("spring", "bending"))
    found, more = (closure("study.experiments.fom", *added) for added in ((), (spring,)))
    around = {"pdrom.model.mesh.generators", "pdrom.core.store", "pdrom.model.constraints"}
    assert around <= set(found)
    assert spring in set(more) - set(found)
    assert not {bending, "pdrom.reduction.basis"} & set(more)


def command(path, *names: str) -> list[object]:
    """Values that a new command finds; it would compute 0 for each of ``names``."""
    memory = Memory(path)
    found = [memory.get(lambda: 0, name, "same") for name in names]
    memory.save()
    return found


def test_stored_data_are_found_by_all_their_dependencies(tmp_path):
    path = tmp_path / "new" / "plan.json"
    first = Memory(path)
    assert first.get(lambda: [1], "a", "same") == first.get(lambda: [2], "a", "same") == [1]
    first.save()
    assert command(path, "a", "b") == [[1], 0]
    assert command(path, "b") == [0], "nothing new: the file stays"
    assert command(path, "c") == [0], "the file loses what was not used"
    assert command(path, "a") == [0]


@pytest.mark.parametrize("content", [b"", b"[1]"])
def test_a_damaged_or_unwritable_memory_is_ignored(tmp_path, content):
    (tmp_path / "plan.json").write_bytes(content)
    assert command(tmp_path / "plan.json" / "below", "a") == command(tmp_path / "plan.json", "a")


def test_a_changed_scene_is_built_again_and_the_warning_is_repeated(tmp_path, monkeypatch, caplog):
    project = make_project(tmp_path, {SCENE: with_mesh(f"{{kind: file, path: {MESH}}}")})
    build, built = scenes.load_bound_scene, []
    monkeypatch.setattr(scenes, "load_bound_scene", lambda *a: built.append(a) or build(*a))

    def vertices() -> int:
        """Number of vertices that a new command finds; it warns about the side that it fixes."""
        command = Memory(tmp_path / "plan.json")
        monkeypatch.setattr(scenes, "memory", lambda: command)
        caplog.clear()
        found = scenes.checked_scene(project, "small")[1][0]
        command.save()
        (warned,) = [r.getMessage() for r in caplog.records if r.levelname == "WARNING"]
        assert f"holds 2 of {found} vertices, fewer than 3" in warned
        return found

    assert [vertices(), vertices(), len(built)] == [4, 4, 1]
    (project / "config" / "scenes" / MESH).write_text(f"{SQUARE}v 2 0 1\nf 3 2 5\n", "utf-8")
    assert [vertices(), vertices(), len(built)] == [5, 5, 2]
    monkeypatch.setenv("PDROM_MESH_LIMITS", "2")
    assert [vertices(), vertices(), len(built)] == [5, 5, 3]
    (project / "config" / "scenes" / MESH).unlink()
    for _ in range(2):
        with pytest.raises(ConfigurationError, match=r"square\.obj"):
            vertices()
