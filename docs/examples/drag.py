"""Drag a bar in a page: a reduced model runs in the browser."""

from pdrom.api import build_scene, run, train, view


def bar(name, *more):
    """Return the scene of a bar that is fixed on the left."""
    return build_scene(
        name=name,
        mesh={"kind": "bar", "nx": 20, "ny": 4, "nz": 4},
        masses=[{"density": 1000.0}],
        frames=80,
        effects=[
            {"effect": "gravity"},
            {"effect": "pins", "select": "x_min"},
            *more,
            {"effect": "tetrahedron_strain", "weight": 2e6},
        ],
    )


move = {"effect": "translate", "select": "x_max", "offset": [0.0, 0.8, 0.5], "over": 60}
hanging, pulled = run(bar("hanging")), run(bar("pulled", move))
model = train(hanging, pulled, modes=20)
print(model)
model.view("drag.html", hanging)  # drag both ends; wires show the full-order run
view("drag.png", pulled, model.run(pulled.scene))
