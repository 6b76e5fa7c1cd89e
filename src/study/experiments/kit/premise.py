"""Whether two runs of a scene that differ in their projections can be compared by their forces.

The theorem of `study.experiments.kit.boundedness` asks of a scene, contacts aside, that

* every force accelerates by -c v and a part that does not depend on the motion, so that the
  velocities of two runs go into their next frame by the same factor 1 - h c, of at most one;
* a vertex that is held has the same target in both runs, or keeps the distance that it had when it
  was taken hold of: a handle that turns has to have held its vertices from the first frame on;
* the projections of every group are bounded.
"""

import numpy as np

from pdrom.model.effects.held import held_vertices
from pdrom.model.scene import Scene
from study.experiments.kit.boundedness import kept_velocity, largest_projections


def outside(scene: Scene) -> str | None:
    """Reason why a scene does not satisfy the premise; None if it does, but for its contacts."""
    for force in scene.forces:
        if force.rate is None:
            return f"the force of effect '{force.name}' depends on the motion, not by a rate alone"
    if np.abs(kept_velocity(scene)).max() > 1.0:
        return "its forces turn a velocity round and enlarge it within a frame"
    for group in scene.groups:
        if largest_projections(group, scene.mesh.points) is None:
            return f"the projections of group '{group.name}' are not bounded"
    return _taken_apart(scene)


def _taken_apart(scene: Scene) -> str | None:
    """Names an effect that takes vertices where two runs may differ, and turns them."""
    same = np.ones(scene.mesh.vertices, dtype=bool)
    for frame in range(scene.config.frames):
        for boundary in scene.boundaries:
            if boundary.by_offsets or not boundary.active(frame):
                continue
            if not same[boundary.held(frame)].all():
                return f"effect '{boundary.name}' turns vertices that were free before"
        held = np.zeros_like(same)
        held[held_vertices(scene.boundaries, frame)] = True
        same &= held
    return None
