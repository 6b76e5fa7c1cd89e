"""Train a model on four trajectories, and run a fifth."""

from pdrom.api import build_scene, run, train, view


def pulled(name, offset):
    """Return the scene of a bar whose right end moves by ``offset`` (m) and is then released."""
    move = {"effect": "translate", "select": "x_max", "offset": offset, "over": 60, "until": 60}
    return build_scene(
        name=name,
        mesh={"kind": "bar", "nx": 16, "ny": 3, "nz": 3},
        masses=[{"density": 1000.0}],
        frames=80,
        iterations=50,  # the full-order run is nearly converged
        anderson_window=5,
        effects=[
            {"effect": "gravity"},
            {"effect": "pins", "select": "x_min"},
            move,
            {"effect": "tetrahedron_strain", "weight": 2e6},
        ],
    )


offsets = {"down": [0, -1, 0], "up": [0, 1, 0], "back": [0, 0, -1], "out": [0.5, 0, 0]}
runs = [run(pulled(name, offset)) for name, offset in offsets.items()]
model = train(*runs, modes=20)
print(model)

fifth = pulled("aslant", [0.2, 0.7, 0.7])
full, reduced = run(fifth), model.run(fifth)
print(reduced.error(full))
view("fifth_run.png", full, reduced)
