"""What a plan remembers: it is computed anew as soon as anything that it depends on changes."""

import pytest

from bad_input.project import MESH, SCENE, SQUARE, make_project, with_mesh
from pdrom.core.errors import ConfigurationError
from study.pipeline import scenes
from study.pipeline.fingerprint import Memory


def command(path, *names: str) -> list[object]:
    """What a new command gets that would compute 0 for each of ``names``."""
    memory = Memory(path)
    found = [memory.get(lambda: 0, name, "same") for name in names]
    memory.save()
    return found


def test_data_are_kept_for_the_next_command_by_all_that_they_depend_on(tmp_path):
    path = tmp_path / "new" / "plan.json"
    first = Memory(path)
    assert first.get(lambda: [1], "a", "same") == first.get(lambda: [2], "a", "same") == [1]
    first.save()
    assert command(path, "a", "b") == [[1], 0]
    assert command(path, "b") == [0], "nothing new: the file stays"
    assert command(path, "c") == [0], "the file loses what was not used"
    assert command(path, "a") == [0]


@pytest.mark.parametrize("content", [b"", b"[1]", b"1", b"{", b"\xff"])
def test_a_damaged_file_and_one_that_cannot_be_written_count_as_none(tmp_path, content):
    (tmp_path / "plan.json").write_bytes(content)
    assert command(tmp_path / "plan.json" / "below", "a") == command(tmp_path / "plan.json", "a")


def test_a_scene_is_built_again_if_a_file_changes_and_its_warning_is_repeated(
    tmp_path, monkeypatch, caplog
):
    project = make_project(tmp_path, {SCENE: with_mesh(f"{{kind: file, path: {MESH}}}")})
    build, built = scenes.load_bound_scene, []
    monkeypatch.setattr(scenes, "load_bound_scene", lambda *a: built.append(a) or build(*a))

    def vertices() -> int:
        """Number of vertices that a new command finds; it warns of the side that it holds."""
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
    (project / "config" / "scenes" / MESH).unlink()
    for _ in range(2):
        with pytest.raises(ConfigurationError, match=r"square\.obj"):
            vertices()
