"""Describe a sheet, simulate it and look at it."""

from pdrom.api import build_scene, run, view

scene = build_scene(
    name="hanging_sheet",
    mesh={"kind": "cloth", "rows": 24, "columns": 24, "plane": "xz"},
    masses=[{"density": 0.2}],  # kg/m^2, cotton
    frames=60,
    effects=[
        {"effect": "gravity"},
        {"effect": "pins", "select": [0, 23]},  # two corners
        {"effect": "spring", "weight": 5.0},  # N/m
        {"effect": "bending", "weight": 1e-5},  # N m
    ],
)
full = run(scene)
print(full)
view("sheet.html", full)  # a page to turn the sheet and to play the frames
view("sheet.png", full)
