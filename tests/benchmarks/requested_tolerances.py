"""Requested tolerances on scenes that differ from the trained ones: how many are not met.

    .venv/bin/python tests/benchmarks/requested_tolerances.py [SCENES]

Every scene is drawn with a seed of its own and trained; then a stiffer, a lighter one and one with
a longer time step, three times each, run with three tolerances. The named cases follow. An error
counts over all frames for which the run says that the tolerance is met, against frames solved to
convergence; a run that says so for no frame is refused. Times play no part.
"""

import sys
from collections import Counter
from collections.abc import Iterator
from typing import Any

import numpy as np

from pdrom.api import FullRun, build_scene, reduce
from pdrom.model.runs import converged_run
from pdrom.model.scene import Scene
from pdrom.reduction.requested.levels import relative_errors

TOLERANCES = (0.1, 0.03, 0.01)
MATERIALS = ("spring", "strain", "deformation_gradient", "tetrahedron_strain")


def config(seed: int) -> dict[str, Any]:
    """Configuration of the scene drawn with ``seed``: a sheet or a bar that is held and moved."""
    rng = np.random.default_rng(seed)
    material, side = MATERIALS[seed % 4], int(rng.integers(5, 9))
    sheet = {"kind": "cloth", "rows": side, "columns": side, "plane": "xz"}
    bar = {"kind": "bar", "nx": side + 2, "ny": 3, "nz": 3}
    moved = {"select": "right", "offset": rng.uniform(-0.3, 0.3, 3).tolist(), "over": 15}
    effects = [
        {"effect": "gravity"},
        {"effect": "pins", "select": "left"},
        {"effect": material, "weight": float(10.0 ** rng.uniform(4, 6))},
        {"effect": "kick", "speed": float(rng.uniform(0.0, 0.5)), "seed": seed},
    ]
    return {
        "frames": int(rng.integers(20, 50)),
        "mesh": sheet if seed % 4 < 2 else bar,
        "effects": effects + [{"effect": "translate", **moved}] * int(rng.integers(0, 2)),
    }


def changed(
    base: dict[str, Any], stiffer: float = 1.0, kick: float | None = None, **keys: float
) -> dict[str, Any]:
    """``base`` with weights ``stiffer`` times as large, another ``kick`` (m/s), other ``keys``."""
    effects = [dict(effect) for effect in base["effects"]]
    for effect in effects:
        if "weight" in effect:
            effect["weight"] *= stiffer
        if kick is not None and effect["effect"] == "kick":
            effect["speed"] = kick
    return {**base, "effects": effects, **keys}


def outcome(trained: Scene, scene: Scene, tolerance: float) -> tuple[str, float]:
    """What became of a run of ``scene``: kept, broken, refused; its error over the tolerance."""
    frames = trained.config.frames
    positions = np.zeros((frames + 1, *trained.mesh.points.shape))
    made = reduce(FullRun(trained, positions, np.ones(frames), {}), error=tolerance, scene=scene)
    end = made.outcome.frames
    if not end:
        return "refused", 0.0
    exact = converged_run(scene, 1e-9, 8000)
    if exact is None:
        return "unknown", 0.0
    wrong = made.outcome.positions[1 : end + 1] - exact[1 : end + 1]
    error = float(relative_errors(wrong, exact, "position")[-1])
    part = "kept" if end == scene.config.frames else "kept for a part of the frames"
    return "broken" if not error <= tolerance else part, error / tolerance


def named() -> Iterator[tuple[str, dict[str, Any], dict[str, Any], float]]:
    """Cases by name: trained and run configuration, tolerance."""
    soft = changed(config(0), stiffer=1e3 / config(0)["effects"][2]["weight"])
    yield "weight 1e3 trained, 1e6 run", soft, changed(soft, stiffer=1e3), 0.01
    for seed in (4, 5, 6):
        base = config(seed)
        yield "mass 10 trained, .1 run", base, changed(base, vertex_mass=0.1), 0.01
        yield "three times the step", base, changed(base, time_step=0.048), 0.01
        yield "thirty times the weight", base, changed(base, stiffer=30.0), 0.01
        yield "1e-14 requested", base, base, 1e-14
        yield "1e-6 requested", base, base, 1e-6
        yield "chaotic: kicked by 20 m/s", base, changed(base, kick=20.0, frames=200), 0.1


def main(scenes: int) -> None:
    """Write the counts of all drawn scenes and a line for each named case."""
    counts, worst = Counter[str](), 0.0
    for seed in range(scenes):
        base = config(seed)
        trained = build_scene(**base)
        for change in ({"stiffer": 3.0}, {"vertex_mass": 10.0 / 3.0}, {"time_step": 0.048}):
            scene = build_scene(**changed(base, **change))
            for tolerance in TOLERANCES:
                result, error = outcome(trained, scene, tolerance)
                counts[result], worst = counts[result] + 1, max(worst, error)
        sys.stdout.write(f"{3 * len(TOLERANCES) * (seed + 1)}: {dict(counts)}, worst {worst:.2g}\n")
        sys.stdout.flush()
    for name, base, run, tolerance in named():
        found = outcome(build_scene(**base), build_scene(**run), tolerance)
        sys.stdout.write(f"{name}, {tolerance:g}: {found[0]}, {found[1]:.2g} of the tolerance\n")


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 56)
