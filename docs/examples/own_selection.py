"""Compare a user-defined selection of elements with the built-in selection."""

import numpy as np
from scipy.optimize import nnls

from pdrom.api import build_scene, plot, run, train


def at_random(G, b, tolerance):
    """Add random elements with non-negative factors until the residual is small."""
    order = np.random.default_rng(1).permutation(G.shape[1])
    for count in range(20, G.shape[1] + 20, 20):
        chosen = np.sort(order[:count])
        factors, residual = nnls(G[:, chosen], b)
        if residual <= tolerance * np.linalg.norm(b):
            break
    return chosen, factors


scene = build_scene(
    name="curtain",
    mesh={"kind": "cloth", "rows": 16, "columns": 16, "plane": "xz"},
    masses=[{"density": 0.2}],
    frames=60,
    effects=[
        {"effect": "gravity"},
        {"effect": "pins", "select": "z_min"},
        {"effect": "spring", "weight": 5.0},
    ],
)
full = run(scene)
built_in = train(full, modes=15)
own = train(full, modes=15, selection=at_random)
for name, model in {"built in": built_in, "at random": own}.items():
    print(name, model)
plot(full, built_in.run(scene), own.run(scene)).savefig("own_selection.png")
