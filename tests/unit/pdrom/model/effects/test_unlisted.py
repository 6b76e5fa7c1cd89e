"""An effect that a scene does not list costs no time and no memory."""

import json
import subprocess
import sys
from functools import cache

import numpy as np
import pytest

from builders import GROUPS, make_scene
from pdrom.model.constraints.base import ConstraintGroup
from pdrom.model.effects import EFFECTS
from pdrom.model.runs import trajectory
from pdrom.model.scene import SceneConfig
from places import ROOT
from study.pipeline.fingerprint import closure
from study.pipeline.scenes import read_scene

FRAMES = 12
SCENES = sorted(path.stem for path in (ROOT / "config" / "scenes").glob("*.yaml"))

# An entry of each effect that cannot act within `FRAMES` frames; None if it always acts.
LATE = {"select": "top", "start": FRAMES}
FAR = 1e6
IDLE: dict[str, dict | None] = {
    "gravity": {"acceleration": [0, 0, 0]},
    "damping": {"rate": 0},
    "drag": {"coefficient": 0},
    "wind": {"velocity": [0, 0, 1e4], "density": 0},
    "floor": {"height": -FAR},
    "plane": {"point": [0, -FAR, 0], "friction": 1},
    "sphere": {"centre": [0, -FAR, 0], "radius": 1, "friction": 1},
    "box": {"lower": [-1, -FAR, -1], "upper": [1, 1 - FAR, 1], "friction": 1},
    "self_collision": {"thickness": 1e-6},
    "kick": {"speed": 1e-300, "seed": 1},
    "velocity": {"value": [0, 0, 0]},
    "pins": LATE,
    "translate": {**LATE, "offset": [0, 1, 0], "over": 3},
    "rotate": {**LATE, "axis": "x", "degrees": 90, "over": 3},
    "keyframes": {**LATE, "keys": [{"at": 3, "offset": [0, 1, 0]}]},
    "poke": None,
}


def other_group(effect: str) -> str:
    """A constraint group for a scene that does not list ``effect``."""
    return "spring" if effect != "spring" else "strain"


@cache
def report(group: str) -> dict:
    """Imports, compiled functions and memory of a scene of one group, in a fresh process."""
    effects = [name for name in EFFECTS if other_group(name) == group]
    done = subprocess.run(
        [sys.executable, "holdings_of_scenes.py", group, *effects],
        cwd=ROOT / "tests", capture_output=True, text=True, check=True,
    )  # fmt: skip
    return json.loads(done.stdout)


@pytest.mark.parametrize("effect", EFFECTS)
def test_a_scene_neither_imports_an_unlisted_effect_nor_allocates_memory_for_it(effect):
    """Compiled functions, arrays, bytes and positions are equal before and after it is loaded."""
    group = other_group(effect)
    found = report(group)
    assert EFFECTS[group].partition(":")[0] in found["modules"]
    assert EFFECTS[effect].partition(":")[0] not in found["modules"]
    alone, beside = found["alone"], found[effect]
    assert alone["arrays"] > 5
    for what in ("arrays", "bytes", "run"):
        assert beside[what] == alone[what], what
    own = {
        n: count
        for n, count in beside["compiled"].items()
        if n.rpartition(".")[0] in found["modules"]
    }
    assert own == alone["compiled"] != {}


@pytest.mark.parametrize("effect", [name for name in EFFECTS if IDLE.get(name, {}) is not None])
def test_an_effect_that_cannot_act_changes_no_bit(effect):
    """The scene is a sheet that falls, fixed on one side, and starts from a deformed shape."""
    if issubclass(EFFECTS.load(effect), ConstraintGroup):
        check_group(effect)
    else:
        assert run_with({"effect": effect, **IDLE[effect]}).tobytes() == run_with().tobytes()


def run_with(*effects):
    spring, gravity = {"effect": "spring", "weight": 1e4}, {"effect": "gravity"}
    pins = {"effect": "pins", "select": [0, 1, 2]}
    scene = make_scene(gravity, pins, spring, *effects, frames=FRAMES)
    noise = 0.01 * np.random.default_rng(3).standard_normal(scene.mesh.points.shape)
    return trajectory(scene, perturbation=noise)


def check_group(effect):
    """A group always acts; projections of another group in the same scene keep their bits."""
    if effect not in ("bending", "spring", "strain"):
        mesh, group = GROUPS[effect], "spring"
    else:
        mesh, group = GROUPS["bending"], other_group(effect)
    first, second = {"effect": group, "weight": 1e4}, {"effect": effect, "weight": 1e4}
    alone, beside = (make_scene(first, *others, mesh=mesh) for others in ((), (second,)))
    rng = np.random.default_rng(3)
    q = alone.mesh.points + 0.05 * rng.standard_normal(alone.mesh.points.shape)
    projections = []
    for scene in (alone, beside):
        groups = {each.name: each.for_run() for each in scene.groups}
        for each in groups.values():
            each.begin_frame(q)
        projections.append(groups[group].project(q).tobytes())
    assert projections[0] == projections[1]


@pytest.mark.parametrize("scene", SCENES)
def test_a_scene_depends_only_on_the_code_of_effects_that_it_lists(scene):
    config = read_scene(ROOT, scene)
    covered = set(closure("study.experiments.fom", *config.modules))
    listed = {EFFECTS[effect.effect].partition(":")[0] for effect in config.effects}
    needed = set(closure(*listed))
    every = {EFFECTS[effect].partition(":")[0] for effect in EFFECTS}
    assert listed <= covered
    assert covered & every <= needed


@pytest.mark.parametrize("effect", IDLE)
def test_a_job_gets_the_configuration_of_the_scene_unchanged(effect):
    """Also with a shape as selection and infinite friction."""
    entry: dict = {"effect": effect, **(IDLE[effect] or {})}
    ball = {"kind": "sphere", "centre": [0, 2, 0], "radius": 0.5}
    if "select" in entry:
        entry["select"] = {"kind": "union", "of": ["top", {"kind": "complement", "of": ball}]}
    if "friction" in entry:
        entry["friction"] = float("inf")
    masses = [{"select": ball, "density": 2.0}]
    config = make_scene({"effect": "spring", "weight": 1.0}, entry, masses=masses).config
    plain = json.loads(json.dumps(config.model_dump(mode="json")))
    assert SceneConfig.model_validate(plain) == config
