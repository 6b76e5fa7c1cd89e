"""Compare estimated frame errors with errors against a minimiser, on soft to very stiff scenes."""

import numpy as np

from builders import GRAVITY, LEFT, make_scene
from pdrom.model.dynamics.convergence import frame_error
from pdrom.model.runs import ConvergedStepper

CLOTH = {"kind": "cloth", "rows": 12, "columns": 11, "plane": "xz"}, 0.2, (1e1, 1e2, 1e3, 1e4, 1e5)
BAR = {"kind": "bar", "nx": 14, "ny": 3, "nz": 3}, 1e3, (1e5, 1e6, 1e7, 1e9, 1e11)
MESHES = {"spring": CLOTH, "strain": CLOTH, "deformation_gradient": BAR, "tetrahedron_strain": BAR}
SCENES = [(kind, weight) for kind, mesh in MESHES.items() for weight in mesh[2]]


def scene_of(kind, weight, iterations=10, window=0, frames=60):
    effects = GRAVITY, LEFT, {"effect": "floor", "height": -0.4}, {"effect": kind, "weight": weight}
    mesh, masses = MESHES[kind][0], [{"density": MESHES[kind][1]}]
    return make_scene(*effects, mesh=mesh, masses=masses, frames=frames).iterated(
        iterations, window
    )


def share(*scenes):
    """Share of estimates within a factor of three of the error against a minimiser (above 1e-6)."""
    found = []
    for scene in scenes:
        loop, state, extent = scene.stepper(estimate=True), scene.initial_state(), scene.mesh.extent
        best = ConvergedStepper(scene, scene.system, 1e-11, 10_000)
        for frame in range(scene.config.frames):
            q, (state, _) = state.positions, loop.step(before := state, frame)
            if frame in loop.errors:
                exact = best.step(before, frame)[0].positions
                true = frame_error(state.positions, exact, q, scene.masses, extent)
                found.append(np.log(max(loop.errors[frame], 1e-6) / max(true, 1e-6)))
    return np.mean(np.abs(found) < np.log(3.0))
