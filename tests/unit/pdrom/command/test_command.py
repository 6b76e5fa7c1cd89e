"""The command line: each command does its work, reports it in a line, and exits with its code."""

import io
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import h5py
import meshio
import numpy as np
import pytest
import yaml

from builders import SMALL, depths
from mesh_files import write_mesh
from pdrom import __version__
from pdrom.api import load, load_scene
from pdrom.command.base import Status
from pdrom.command.main import COMMANDS, parser, run
from pdrom.command.new import template
from pdrom.command.progress import Progress
from pdrom.core.store import MARK, check_file
from pdrom.core.store.checksum import BLOCK
from pdrom.core.yamlfile import read_yaml
from pdrom.model.constraints.base import WeightFactor
from pdrom.model.dynamics.stepper import FrameReport
from pdrom.model.effects import EFFECTS, MATERIALS
from pdrom.model.effects.hold import Key
from pdrom.model.mesh.config import BarMesh, ClothMesh, MeshFile
from pdrom.model.mesh.generators import bar, cloth
from pdrom.model.mesh.reader import READERS
from pdrom.model.mesh.selection import Shape
from pdrom.model.mesh.types import vertex_measures
from pdrom.model.runs import converged_run, trajectory
from pdrom.model.scene import HeldOut, MassConfig, ReductionPlan, Scene, SceneConfig
from pdrom.view.camera import up_of
from places import CONFIG


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """An empty folder with a scene, in which the commands run."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "small.yaml").write_text(SMALL, encoding="utf-8")
    return tmp_path


def test_a_scene_is_run_a_model_trained_and_run_and_all_is_shown(folder, capsys):
    assert run(["run", "small.yaml"]) == Status.DONE
    said = capsys.readouterr()
    assert said.out.startswith("small.h5: 12 frames of 30 vertices")
    asked = ["train", "small.yaml", "small.h5", "--modes", "6", "--validate", "1"]
    assert run(asked) == Status.DONE
    *table, last = capsys.readouterr().out.splitlines()
    assert [row.split()[0] for row in table] == ["trajectory", "small", "small_validation_1"]
    assert last.startswith("small.model.h5: a model of 'small' (6 modes, ")
    compared = ["run", "small.yaml", "--model", "small.model.h5", "--compare", "small.h5"]
    assert run(compared) == Status.DONE
    first, second = capsys.readouterr().out.splitlines()
    assert first.startswith("small_small.h5: 12 frames")
    assert "against the run of 'small' by the full-order model, 10 iterations" in second
    assert run(["view", "small_small.h5", "small.h5"]) == Status.DONE
    goes_on = ["run", "small.yaml", "--from", "small.h5", "--frame", "5", "--out", "later.h5"]
    assert run(goes_on) == Status.DONE
    assert np.array_equal(load("later.h5").positions, load("small.h5").positions)
    assert not list(folder.glob(".*"))  # no hidden file next to the user's files
    capsys.readouterr()
    assert run(["show", "small.yaml"]) == run(["show", "small.model.h5"]) == Status.DONE
    shown = capsys.readouterr().out
    assert shown.count("iterations: 10\neffects:\n  gravity: ") == 2
    assert shown.count("  spring: weight 100000.0 N/m\n") == 2
    for words in ("intact", "model/columns/B: 30 x", "format: 1", "scene: small"):
        assert words in shown
    assert run(["show", "small.h5", "--configuration"]) == Status.DONE
    text = capsys.readouterr().out.split("configuration:\n")[1].split("attributes")[0]
    assert yaml.safe_load(text)["scene"]["name"] == "small"


@pytest.fixture(scope="module")
def finished(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with the scene and its full-order run."""
    folder = tmp_path_factory.mktemp("finished")
    (folder / "small.yaml").write_text(SMALL, encoding="utf-8")
    assert run(["run", str(folder / "small.yaml")]) == Status.DONE
    return folder


TRAIN = ["train", "small.yaml", "--method", "gappy", "--r", "1"]


def refusal(capsys: pytest.CaptureFixture[str], arguments: list[str]) -> str:
    capsys.readouterr()
    assert run(arguments) == Status.FAULTY
    (told,) = capsys.readouterr().err.splitlines()
    return told


def content(folder: Path) -> dict[str, bytes]:
    return {path.name: path.read_bytes() for path in folder.iterdir()}


def reads_of(name: str) -> list[list[str]]:
    """Commands that read a file as a run."""
    return [[*TRAIN, name], ["view", name], ["view", name, "--unchecked"], ["show", name]]


def test_a_run_is_read_in_whichever_folder_its_copy_lies(folder, finished, capsys):
    shutil.copy(finished / "small.h5", "copy.h5")
    shutil.copy(finished / "small.h5", "no suffix")
    for name in ("copy.h5", "no suffix"):
        assert run([*TRAIN, name]) == Status.DONE
        assert run(["show", name]) == Status.DONE
        assert "bytes, intact" in capsys.readouterr().out
        assert check_file(name) == "intact"
    made = {"small.yaml", "small.model.h5"}
    assert set(content(folder)) == {"copy.h5", "no suffix", *made}


@pytest.mark.parametrize("name", ["x.h5", "x.txt", "x", "x.csv", "own.h5"])
def test_a_file_of_the_user_is_never_moved_changed_or_removed(folder, name, capsys):
    Path(name).write_bytes(b"somebody's own\n")
    if name == "own.h5":
        h5py.File(name, "w").create_dataset("numbers", data=[1.0]).file.close()
    before = content(folder)
    for arguments in reads_of(name)[:3]:
        assert refusal(capsys, arguments).startswith(f"pdrom: {name}: ")
    run(["show", name])
    assert content(folder) == before


def test_a_damaged_run_is_refused_and_not_moved(folder, finished, capsys):
    Path("small.h5").write_bytes((finished / "small.h5").read_bytes() + b"more")
    before = content(folder)
    for arguments in reads_of("small.h5")[:3]:
        assert "small.h5: damaged" in refusal(capsys, arguments)
    assert content(folder) == before


def test_a_run_without_a_checksum_is_read_only_with_the_option_for_it(folder, finished, capsys):
    whole = (finished / "small.h5").read_bytes()[BLOCK:]
    Path("small.h5").write_bytes(whole)
    before = content(folder)
    told = refusal(capsys, [*TRAIN, "small.h5"])
    assert told.startswith("pdrom: small.h5: no checksum inside (")
    assert "--unchecked" in told
    assert content(folder) == before
    assert run([*TRAIN, "small.h5", "--unchecked"]) == Status.DONE
    assert run(["view", "small.h5", "--unchecked"]) == Status.DONE
    with h5py.File("small.h5", "r+") as file:
        del file["timings"]
    told = refusal(capsys, [*TRAIN, "small.h5", "--unchecked"])
    assert told.startswith("pdrom: small.h5: contains no complete run")


def test_a_table_is_shown_with_the_meaning_of_its_columns(folder, capsys):
    (folder / "t.csv").write_text("scene,component,none\na,1,\nb,3,\n")
    assert run(["show", "t.csv"]) == Status.DONE
    said = capsys.readouterr().out
    for words in ("2 rows of 3 columns", "scene: a, b\n", "component: 1 to 3\n", "none: empty\n"):
        assert words in said


def test_a_new_scene_is_valid_and_replaces_nothing(folder, capsys):
    assert run(["new", "My Sheet-1"]) == Status.DONE
    text = (folder / "My Sheet-1.yaml").read_text("utf-8")
    assert SceneConfig.model_validate(yaml.safe_load(text)).name == "my_sheet_1"
    (folder / "Two Words.yaml").write_text(re.sub("(?m)^(name|title): .*", "", text))
    config = load_scene("Two Words.yaml").config
    assert (config.name, config.title) == ("two_words", "Two words")
    assert "the file exists already" in refusal(capsys, ["new", "My Sheet-1.yaml"])
    assert (folder / "My Sheet-1.yaml").read_text("utf-8") == text


@pytest.mark.parametrize(
    ("mesh", "listed", "others"),
    [
        (None, {"strain"}, {"translate", "spring", "bending"}),
        (cloth(4, 3), {"strain"}, {"translate", "spring", "bending"}),
        (bar(3, 2, 2, 20.0), {"tetrahedron_strain"}, {"translate", "volume"}),
    ],
)
def test_every_commented_effect_of_a_new_scene_is_valid(folder, mesh, listed, others):
    """The sides, positions and groups of the effects fit the mesh, for every vertical axis."""
    text = template("it's", 'o\'b "1" ü.obj', mesh)
    scene = SceneConfig.model_validate(yaml.safe_load(text))
    assert {*scene.groups, *scene.reduce} == listed
    assert scene.mesh.sources == ([] if mesh is None else ['o\'b "1" ü.obj'])
    for up in "xyz":
        text = template("a", "a.obj", mesh, up).replace("  # - {", "  - {")
        assert "e+" not in text
        every = SceneConfig.model_validate(yaml.safe_load(text))
        Scene.build(every, every.mesh.build(folder) if mesh is None else mesh)
        assert others <= {effect.effect for effect in every.effects}


SEAM = "v 0 0 0\nv 1 0 0\nv 0 0 1\nv 1 0 {0}\nv 0 0 {1}\nv 1 0 1\nf 1 2 3\nf 4 6 5\n"


def test_an_open_seam_is_named_and_merged(folder, capsys, caplog):
    """The mesh has vertices that coincide nearly or exactly, and a vertex in no element."""
    (folder / "a.obj").write_text(SEAM.format("1e-7", "1.0000001"))
    assert run(["new", "a", "--mesh", "a.obj"]) == Status.DONE
    found = "2 connected parts, 2 pairs of vertices closer than 1e-06 of the extent"
    assert f"6 vertices, 2 triangles, {found}; x" in (folder / "a.yaml").read_text()
    assert "merge: 1.0e-06" in caplog.text
    (folder / "b.obj").write_text(SEAM.format(0, 1))
    assert "`merge: 1.0e-06` below `mesh`" in refusal(capsys, ["new", "b", "--mesh", "b.obj"])
    (folder / "c.obj").write_text(SEAM.format(0, 1).replace("f 1", "v 9 9 9\nf 1"))
    assert "leaves them out" in refusal(capsys, ["new", "c", "--mesh", "c.obj"])
    assert "add --mesh" in refusal(capsys, ["new", "c", "--merge", "1e-6"])
    for name in "abc":
        assert run(["new", f"{name}2", "--mesh", f"{name}.obj", "--merge", "1e-6"]) == Status.DONE
        assert run(["run", f"{name}2.yaml"]) == Status.DONE
        assert "100 frames of 4 vertices (1 connected part)" in capsys.readouterr().out


def test_a_new_scene_describes_its_mesh(folder, capsys):
    """The name of the mesh contains a quote, and the scene lies in another folder."""
    (folder / "in").mkdir()
    mesh = cloth(4, 3, "xz", lift=-7.0)
    meshio.write("in/o'b.obj", meshio.Mesh(mesh.points, [("triangle", mesh.triangles)]))
    assert run(["new", "in/no", "--mesh", "in/o'b.obj"]) == Status.DONE
    text = (folder / "in" / "no.yaml").read_text("utf-8")
    for words in ("12 vertices", "12 triangles", "y from -7 to -7", "x_min 3, x_max 3, z_min 4"):
        assert words in text
    scene = load_scene("in/no.yaml")
    (floor,) = [effect for effect in scene.config.effects if effect.effect == "floor"]
    assert -9.0 < floor.height <= -7.5
    for mesh, words in (("../../x", "the mesh must be in or below"), ("none", "no such mesh file")):
        assert words in refusal(capsys, ["new", "other", "--mesh", f"in/{mesh}.obj"])
    assert not (folder / "other.yaml").exists()


@pytest.mark.parametrize("mesh", [cloth(4, 3, "xz", extent=200.0), bar(3, 2, 2, extent=0.01)])
@pytest.mark.parametrize("up", [0, 1, 2])
def test_a_new_scene_has_a_material_lengths_of_its_mesh_and_a_floor_below_it(up, mesh):
    """The material is water or cotton; the pins move by half the extent."""
    text = template("a", "a.obj", mesh, up="xyz"[up])
    scene = Scene.build(SceneConfig.model_validate(yaml.safe_load(text)), mesh)
    density = 1000.0 if len(mesh.tetrahedra) else 0.2
    assert scene.masses.sum() == pytest.approx(density * vertex_measures(mesh).sum())
    assert scene.config.held_out.carry == 0.5 * mesh.extent
    assert up_of(scene.config.effects).tolist() == np.eye(3)[up].tolist()
    (floor,) = scene.contacts
    below = depths(floor, mesh.points)
    assert below.max() <= -mesh.extent / 2.0
    assert depths(floor, mesh.points + np.eye(3)[up]) == pytest.approx(below - 1.0)


def test_a_new_sheet_sags_by_the_same_length_on_a_refined_mesh():
    """The sheet hangs and is damped until it rests; each frame has an error below 1 %."""
    keys, sags = yaml.safe_load(template("a")), []
    keys["effects"] += [{"effect": "damping", "rate": 10.0}, {"effect": "pins", "select": "top"}]
    keys["effects"] = [e for e in keys["effects"] if e.get("select") != "x_min"]
    for size in (10, 20):
        config = SceneConfig.model_validate(keys | {"iterations": 2 * size})
        q = trajectory(scene := Scene.build(config, cloth(size, size)))
        sags.append(float(q[0, :, 1].min() - q[-1, :, 1].min()))
        assert np.abs(q[-1] - q[-2]).max() < 1e-6 < sags[-1]
        assert np.abs(q - converged_run(scene, 1e-6, 20_000)).max() < 0.01 * sags[-1]
    assert sags == pytest.approx([0.01, sags[0]], rel=0.05)


@pytest.mark.parametrize("suffix", READERS)
def test_a_mesh_in_place_of_a_scene_is_named_with_the_command_that_helps(folder, suffix, capsys):
    mesh = f"a{suffix}"
    write_mesh(Path(mesh))
    told = f"pdrom: {mesh}: a mesh, not a scene; `pdrom new --mesh {mesh}` writes a scene for it"
    for command in (["run", mesh], ["train", mesh], ["new", mesh]):
        assert refusal(capsys, command) == told
    assert run(["new", "--mesh", mesh]) == Status.DONE
    assert load_scene("a.yaml").mesh.vertices == 12


SECTIONS = {
    "scene": SceneConfig, "masses": MassConfig, "reduce": ReductionPlan, "held_out": HeldOut,
    "factors": WeightFactor, "keys": Key, "mesh kind cloth": ClothMesh, "mesh kind bar": BarMesh,
    "mesh kind file": MeshFile, **{f"effect {name}": EFFECTS.load(name).Config for name in EFFECTS},
    **{f"material {name}": MATERIALS.load(name) for name in MATERIALS},
    **{f"select kind {kind.model_fields['kind'].default}": kind for kind in Shape.__subclasses__()},
}  # fmt: skip


@pytest.mark.parametrize("form", SECTIONS)
def test_kinds_of_effects_are_shown_with_their_keys_and_defaults(form, capsys):
    texts, fields = read_yaml(CONFIG / "words.yaml"), SECTIONS[form].model_fields
    word = form.split()[-1]
    assert texts.keys() == SECTIONS.keys()
    assert texts[form].keys() - {"is"} == fields.keys() - {"effect", "kind"}
    assert run(["show", word]) == Status.DONE
    shown = capsys.readouterr().out
    for key in texts[form].keys() - {"is", "name", "title"}:
        field, (unit, default, options, _) = fields[key], texts[form][key]
        assert f"  {word}.{key}: {unit and unit + '; '}{default}; " in shown
        assert (default == "required") == field.is_required()
        plain = isinstance(field.default, (int, float, str))
        assert default == f"default {field.default}" or not plain
        for literal in re.findall(r"Literal\[([^]]*)\]", str(field.annotation)):
            assert options == literal.strip("'").replace("', '", " or ")
        for option in filter(None, options.split(" or ")):
            assert run(["show", option]) == Status.DONE


FAULTY = [
    (["run", "none.yaml"], "none.yaml: no such configuration file"),
    (["show", "none.h5"], "none.h5: no such file"),
    (["show", "sprng"], "did you mean 'spring'?"),
    (["new", "nowhere/x"], "No such file"),
    (["show", "."], "is a folder"),
    (["run", "folder.h5"], "folder.h5: a result, not a scene; see `pdrom show folder.h5`"),
    (["run", "."], ".: a folder, name a file in it"),
    ([*TRAIN, "--out", "small.yaml"], "the output would replace a file"),
    (["run", "small.yaml", "--compare", "small.h5"], "--compare: only for reduced runs"),
    (["train", "small.yaml", "--modes", "4", "--r", "3"], "r: no effect without group or method"),
    (["run", "small.yaml", "--model", "none.h5"], "none.h5: no such file"),
    (["run", "small.yaml", "--frame", "3"], "--frame: only with --from"),
    (["run", "small.yaml", "--from", "x.h5", "--model", "x.h5"], "only for full-order runs"),
    (["run", "small.yaml", "--from", "small.h5"], "the output would replace a file"),
    (["run", "small.yaml", "--model", "none.h5", "--check"], "--check: only for full-order runs"),
    (["run", "small.yaml", "--out", "."], ".: cannot be written (a folder)"),
    (["view", "x.h5", "--png", "x.h5"], "the output would replace a file"),
]


def test_foreign_files_and_the_mesh_of_the_scene_are_not_overwritten(folder, capsys):
    Path("mine.h5").write_bytes(b"mine")
    Path("m.obj").write_bytes(b"v 0 0 0\nv 1 0 0\nv 0 0 1\nf 1 2 3\n# " + MARK)
    assert run(["new", "own.yaml", "--mesh", "m.obj"]) == Status.DONE
    for scene, out, words in (
        ("small.yaml", "mine.h5", "cannot be written (a file that pdrom has not made"),
        ("own.yaml", "m.obj", "the output would replace a file that is read"),
    ):
        before = Path(out).read_bytes()
        for command in (["run", scene], ["train", scene, "none.h5"]):
            assert f"{out}: {words}" in refusal(capsys, [*command, "--out", out])
        assert Path(out).read_bytes() == before


@pytest.mark.parametrize(("arguments", "words"), FAULTY)
def test_missing_inputs_and_unwritable_outputs_are_reported_before_a_run_begins(
    folder, arguments, words, monkeypatch, capsys
):
    def called(*_: object, **__: object) -> None:
        raise AssertionError("a run began")

    (folder / "folder.png").mkdir()
    (folder / "folder.h5").touch()
    monkeypatch.setattr("pdrom.api.load", called)
    monkeypatch.setattr("pdrom.api.runs.run_full_order", called)
    assert words in refusal(capsys, arguments)
    assert (folder / "small.yaml").read_text("utf-8") == SMALL


def shell(line: str, folder: Path) -> subprocess.CompletedProcess[str]:
    called = line.replace("pdrom", f'"{sys.executable}" -m pdrom')
    command = ["bash", "-o", "pipefail", "-c", called]
    # buffered until the end, as the output of a user's command
    own = {name: value for name, value in os.environ.items() if name != "PYTHONUNBUFFERED"}
    return subprocess.run(command, cwd=folder, capture_output=True, text=True, env=own, check=False)


@pytest.mark.parametrize(
    ("command", "status", "said"),
    [
        ("pdrom show small.yaml | sh -c 'exec 0<&-'", 0, ""),
        ("pdrom show none.yaml >&- 2>&-", 1, ""),
        ("pdrom show none.yaml >&-", 1, "pdrom: none.yaml: no such file\n"),
    ],
)
def test_a_closed_output_gives_no_traceback(folder, command, status, said):
    done = shell(command, folder)
    assert (done.returncode, done.stderr) == (status, said)


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="there is no /dev/full")
def test_an_output_that_cannot_be_written_gives_one_line(folder):
    done = shell("pdrom show small.yaml > /dev/full", folder)
    assert done.returncode == Status.FAULTY
    assert done.stderr == "pdrom: standard output: No space left on device\n"


def test_errors_during_a_run_are_reported(folder, finished, capsys):
    assert run(["run", "small.yaml", "--out", "nowhere.d/../small.yaml/x.h5"]) == Status.FAULTY
    assert "cannot be written" in capsys.readouterr().err.splitlines()[-1]
    shutil.copy(finished / "small.h5", folder)
    assert "r = 99" in refusal(capsys, [*TRAIN, "small.h5", "--r=99"])
    (folder / "small.yaml").write_text(SMALL.replace("1.0e+5", "2.0e+5"))
    assert "not a run of" in refusal(capsys, [*TRAIN, "small.h5"])


def test_a_diverged_run_has_a_distinct_exit_code(folder, monkeypatch, capsys):
    assert run(TRAIN) == Status.DONE
    monkeypatch.setattr("pdrom.api.model.BLOWUP_EXTENT", 1e-3)
    assert run(["run", "small.yaml", "--model", "small.model.h5"]) == Status.BLEW_UP
    assert "blew up in frame 0" in capsys.readouterr().out
    assert load("small_small.h5").blowup_frame == 0


@pytest.mark.parametrize(
    ("arguments", "meant"),
    [("", ""), ("trian", "'train'"), ("run", ""), ("train x --r a", ""),
     ("train x --group g --modse", "'--modes'")],
)  # fmt: skip
def test_unknown_arguments_exit_with_code_2(arguments, meant, capsys):
    with pytest.raises(SystemExit) as caught:
        run(arguments.split())
    assert caught.value.code == 2
    assert meant in capsys.readouterr().err


@pytest.mark.parametrize("name", COMMANDS)
def test_the_help_of_a_command_has_an_example(name, capsys):
    with pytest.raises(SystemExit) as caught:
        run([name, "--help"])
    assert caught.value.code == 0
    said = capsys.readouterr().out
    example = said.split("example: pdrom ")[1].split()
    assert example[0] == name
    assert parser().parse_args(example).perform


def test_an_interrupt_is_reported_in_one_line(folder, monkeypatch, capsys):
    def interrupted(*arguments, **named):
        raise KeyboardInterrupt

    monkeypatch.setattr("pdrom.api.run", interrupted)
    assert run(["run", "small.yaml"]) == 130
    assert capsys.readouterr().err == "\npdrom: interrupted\n"


def test_python_m_pdrom_is_the_program(tmp_path):
    done = shell("pdrom new x", tmp_path)
    assert (done.returncode, done.stderr) == (0, "")
    assert shell("pdrom --version", tmp_path).stdout == f"pdrom {__version__}\n"
    assert (tmp_path / "x.yaml").is_file()


def test_threads_and_kernels_are_set_before_numpy_is_loaded():
    code = "import sys, pdrom.command.main; sys.exit('numpy' in sys.modules)"
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(sys.path)}
    assert subprocess.run([sys.executable, "-c", code], env=environment).returncode == 0


REPORT = FrameReport(np.zeros(0), np.array([0.0, 1e-3, 1e-3, 0.0]))


def test_progress_on_a_terminal_is_one_line_that_is_overwritten(monkeypatch):
    """The line changes five times a second; its estimate ignores a frame that compiles kernels."""
    stream = io.StringIO()
    stream.isatty = lambda: True
    times = iter([0.0, 50.0, *(50.0 + 0.125 * frame for frame in range(1, 10))])
    monkeypatch.setattr("pdrom.command.progress.monotonic", lambda: next(times))
    told = Progress("small", 10, stream)
    for frame in range(10):
        told(frame, REPORT)
    shown = stream.getvalue()
    assert shown.endswith("  \n")
    assert shown.count("\n") == 1
    frames = [text.split("frame ")[1].split(" of ")[0] for text in shown.split("\r")[1:]]
    assert frames == ["1", "3", "5", "7", "9", "10"]
    assert "frame 5 of 10, 2.00 ms a frame, 1 s left" in shown
