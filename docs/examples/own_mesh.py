"""Simulate a mesh given by arrays, which the wind blows over a ball."""

import numpy as np

from pdrom.api import build_scene, run, view

# a disc of 12 rings; points (N, 3) in m, triangles (T, 3)
rings, spokes = 12, 40
angle = 2 * np.pi * np.arange(spokes) / spokes
radius = np.linspace(0.0, 1.0, rings + 1)[1:]
points = [[0.0, 1.0, 0.0]]
points += [[r * np.cos(a), 1.0, r * np.sin(a)] for r in radius for a in angle]
inner = [[0, 1 + (k + 1) % spokes, 1 + k] for k in range(spokes)]
outer = []
for ring in range(rings - 1):
    for k in range(spokes):
        a, b = (1 + ring * spokes + (k + i) % spokes for i in (0, 1))
        outer += [[a, b, a + spokes], [b, b + spokes, a + spokes]]

scene = build_scene(
    name="disc_in_the_wind",
    mesh=(np.array(points), np.array([*inner, *outer])),
    masses=[{"density": 0.2}],
    frames=100,
    effects=[
        {"effect": "gravity"},
        {"effect": "wind", "velocity": [3.0, 0.0, 0.0]},
        {"effect": "sphere", "centre": [0.2, 0.4, 0.0], "radius": 0.4, "friction": 0.5},
        {"effect": "floor"},
        {"effect": "strain", "weight": 20.0},
    ],
)
full = run(scene)
view("own_mesh.html", full)
view("own_mesh.png", full)
