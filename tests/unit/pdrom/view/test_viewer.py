"""The viewer: packed positions are accurate, the page is one file and works in a real browser."""

import base64
import json
import zlib
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from playwright.sync_api import Page

from browser import page_at, picture
from pdrom.core.errors import StorageError
from pdrom.core.packed import LEVELS, pack_positions
from pdrom.model.effects.base import effect_config
from pdrom.model.mesh.generators import bar, cloth
from pdrom.view import page as writer
from pdrom.view.camera import Y, rotation_to, shown_region
from pdrom.view.page import EYE, FRAMES, ViewedRun, ViewedScene, pack_scene, write_page


def unpack_positions(packed: dict[str, Any]) -> np.ndarray:
    """The positions (F, N, 3) that the page draws."""
    data = zlib.decompress(base64.b64decode(packed["changes"]))
    changes = np.frombuffer(data, "<u2").reshape(packed["frames"], packed["vertices"], 3)
    levels = np.cumsum(changes, axis=0, dtype=np.int64) % (LEVELS + 1)
    return np.array(packed["low"]) + np.array(packed["step"]) * levels


@given(st.integers(1, 4), st.integers(1, 5), st.floats(1e-6, 1e6), st.integers(0, 2**32 - 1))
def test_packed_positions_are_accurate_to_half_a_step(frames, vertices, size, seed):
    positions = size * np.random.default_rng(seed).normal(size=(frames, vertices, 3))
    positions[..., 2] = 0.5 * size  # a sheet without thickness
    found = unpack_positions(pack_positions(positions))
    box = np.ptp(positions, axis=(0, 1))
    assert np.all(np.abs(found - positions) <= 0.5001 * box / LEVELS + 1e-15 * size)


OBSTACLES = [
    {"effect": "gravity"},
    {"effect": "floor", "height": 1.0},
    {"effect": "sphere", "centre": [0.0, 1.6, 0.0], "radius": 0.3, "friction": float("inf")},
    {"effect": "box", "lower": [-0.5, 1.0, -0.5], "upper": [-0.2, 1.2, 0.5]},
    {"effect": "plane", "point": [0.5, 1.5, 0.0], "normal": [-1.0, 0.3, 0.0]},
]


def viewed(
    name: str = "sheet", frames: int = 12, runs: int = 2, effects: Sequence[dict] = ()
) -> ViewedScene:
    """A sheet that sinks; one reduced run is near it, the other one bends up and ends early."""
    mesh = cloth(6, 6, "xz", 1.0, 2.0, 0.0)
    t = np.linspace(0.0, 1.0, frames + 1)[:, None]
    full = np.repeat(mesh.points[None], frames + 1, axis=0)
    full[..., 1] -= t * mesh.points[:, 0] ** 2
    bent = full.copy()
    bent[..., 1] += 1.5 * t * np.abs(mesh.points[:, 0])
    error = np.linspace(1e-3, 1.0, frames)
    half = frames // 2
    near = ViewedRun("near", full + 0.01, error, None, 0.5)
    end = half + 1
    far = ViewedRun("far", bent[:end], error[:half], half, None)
    return ViewedScene(
        name, "A <sheet> <!--<script> </script>", mesh, 0.02, full, 1.0,
        (near, far)[:runs], tuple(effect_config(entry, i) for i, entry in enumerate(effects)),
    )  # fmt: skip


def test_only_the_surface_and_few_frames_are_packed():
    mesh = bar(6, 4, 4)
    positions = np.repeat(mesh.points[None], 3 * FRAMES, axis=0)
    packed = pack_scene(ViewedScene("bar", "Bar", mesh, 0.01, positions, None))
    assert packed["full"]["vertices"] == len(np.unique(mesh.triangles)) < mesh.vertices
    assert FRAMES / 2 < packed["full"]["frames"] <= FRAMES + 1
    assert unpack_positions(packed["full"])[0].max() == pytest.approx(mesh.points.max(), rel=1e-4)
    assert json.dumps(packed, allow_nan=False)


def test_every_obstacle_is_packed_with_its_surface():
    packed = pack_scene(viewed(effects=OBSTACLES))
    bodies = [np.array(body["points"]) for body in packed["bodies"]]
    assert len(bodies) == 4  # gravity has none
    floor, sphere, box, _ = bodies
    assert floor[1] == pytest.approx(np.full(4, 1.0))
    radii = np.linalg.norm(sphere.T - [0.0, 1.6, 0.0], axis=1)
    assert radii == pytest.approx(0.3, abs=1e-3)  # coordinates have four digits
    assert box.min(axis=1) == pytest.approx([-0.5, 1.0, -0.5])


@pytest.mark.parametrize(
    ("obstacle", "whole"),
    [
        ({"centre": [0.0, -0.3, 0.0], "radius": 0.25}, True),
        ({"centre": [0.0, -9.0, 0.0], "radius": 0.25}, False),
        ({"centre": [0.0, -3.0, 0.0], "radius": 2.9}, False),
    ],
    ids=["beside", "far away", "larger than the run"],
)
def test_an_obstacle_near_the_run_is_shown_completely(obstacle, whole):
    run = np.random.default_rng(0).uniform(-0.5, 0.5, (3, 20, 3))
    effects = [effect_config({"effect": "sphere", **obstacle}, 0)]
    low, high = shown_region(run, effects)
    assert np.ptp(high - low) == pytest.approx(0.0)  # a cube
    assert (low < run.min(axis=(0, 1))).all()
    assert (high > run.max(axis=(0, 1))).all()
    body = effects[0].body(low, high).points
    assert ((body > low) & (body < high)).all() == whole
    if not whole:
        assert np.array_equal((low, high), shown_region(run, []))


def test_a_page_that_is_too_large_is_refused(tmp_path, monkeypatch):
    monkeypatch.setattr(writer, "LARGEST", 1000)
    with pytest.raises(StorageError, match="choose fewer runs"):
        write_page([viewed()], tmp_path / "x.html")
    assert not list(tmp_path.iterdir())


def test_no_title_ends_a_script_of_the_page(tmp_path):
    write_page([viewed()], tmp_path / "x.html")
    text = (tmp_path / "x.html").read_text("utf-8")
    # neither the end of the element nor a comment that hides it from a browser
    data = text.split('<script id="scenes" type="application/json">')[1].split("</script>")[0]
    assert "<" not in data
    assert json.loads(data)[0]["title"] == viewed().title


@pytest.mark.parametrize(
    ("pulls", "up"),
    [
        ([], [0.0, 1.0, 0.0]),
        ([[0.0, -9.81, 0.0]], [0.0, 1.0, 0.0]),
        ([[0.0, 0.0, -9.81]], [0.0, 0.0, 1.0]),
        ([[0.0, 9.81, 0.0]], [0.0, -1.0, 0.0]),
        ([[0.0, -3.0, 0.0], [4.0, 0.0, 0.0]], [-0.8, 0.6, 0.0]),
        ([[0.0, -1.0, 0.0], [0.0, 1.0, 0.0]], [0.0, 1.0, 0.0]),
    ],
)
def test_up_is_opposite_to_gravity_and_the_camera_follows_it(pulls, up):
    effects = [{"effect": "gravity", "acceleration": pull} for pull in pulls]
    view = pack_scene(viewed(effects=effects))["view"]
    assert view["up"] == pytest.approx(up)
    assert np.linalg.norm(view["eye"]) == pytest.approx(np.linalg.norm(EYE))
    assert np.dot(view["eye"], up) == pytest.approx(EYE @ Y)


@given(st.tuples(*3 * [st.floats(-1.0, 1.0)]).filter(lambda v: np.linalg.norm(v) > 0.1))
def test_the_rotation_maps_y_to_the_given_direction_without_mirroring(direction):
    up = np.array(direction) / np.linalg.norm(direction)
    found = rotation_to(up)
    assert found @ Y == pytest.approx(up, abs=1e-9)
    assert found.T @ found == pytest.approx(np.eye(3), abs=1e-6)
    assert np.linalg.det(found) == pytest.approx(1.0)


def ready(page: Page) -> None:
    page.wait_for_selector('body[data-ready="yes"]')


def choose(page: Page, **chosen: str) -> None:
    for name, label in chosen.items():
        page.select_option(f"#{name}", label=label)
        ready(page)


def go_to(page: Page, frame: int) -> None:
    page.focus("#frame")
    page.keyboard.press("Home")
    for _ in range(frame):
        page.keyboard.press("ArrowRight")
    page.wait_for_selector(f'body[data-frame="{frame}"]')


def differ(first: np.ndarray, second: np.ndarray) -> bool:
    """Whether more than 0.1 % of the pixels changed clearly."""
    return np.mean(np.abs(first - second).max(axis=2) > 30) > 1e-3


@pytest.mark.slow
def test_a_truncated_page_says_so(tmp_path: Path) -> None:
    path = tmp_path / "cut.html"
    write_page([viewed()], path)
    whole = path.read_text("utf-8")
    damaged = whole.replace('"changes":"', '"changes":"AAAA', 1)
    for text in (damaged, *(whole[: len(whole) * part // 10] for part in (1, 3, 5, 9))):
        path.write_text(text, encoding="utf-8")
        with page_at(path.as_uri(), width=1000, height=700) as page:
            assert "the file was cut" in page.inner_text("body")


@pytest.mark.slow
def test_runs_frames_obstacles_and_the_direction_up_are_seen_without_a_network(
    tmp_path: Path,
) -> None:
    """The sheet is lit, and the picture of a shape depends on the direction up."""
    sideways = [{"effect": "gravity", "acceleration": [0.0, 0.0, -9.81]}]
    others = viewed("obstacles", effects=OBSTACLES), viewed("sideways", effects=sideways)
    write_page([viewed(), *others], tmp_path / "index.html")
    with page_at((tmp_path / "index.html").as_uri(), width=1000, height=700) as page:
        ready(page)
        shapes = page.locator("#shapes")
        choose(page, scene="sheet", run="near")
        # errors of both runs are from 1e-3 to 1
        assert page.get_attribute("#errors", "data-decades") == "-3 0"
        seen = {}
        for frame, run in ((0, "near"), (6, "near"), (6, "far")):
            choose(page, run=run)
            go_to(page, frame)
            seen[frame, run] = picture(shapes)
        start, middle, bent = seen.values()
        assert np.mean(start.min(axis=2) < 200) > 0.01  # something is drawn
        assert differ(start, middle)
        assert differ(middle, bent)
        assert "blew up at frame 6" in page.inner_text("#about")
        red, _, blue = np.moveaxis(bent, 2, 0)
        grey = bent[(red - blue > 8) & (red - blue < 30) & (red < 230)].mean(axis=1)
        assert np.ptp(np.percentile(grey, [2, 98])) > 8
        page.uncheck("#colour")
        ready(page)
        assert differ(bent, picture(shapes))
        choose(page, scene="sheet", run="near", view="on top of each other")
        go_to(page, 0)
        upright = picture(shapes)
        for scene in ("obstacles", "sideways"):
            choose(page, scene=scene, run="near")
            go_to(page, 0)
            assert differ(upright, picture(shapes))
        page.focus("#play")
        page.keyboard.press("Enter")
        page.wait_for_selector('body:not([data-frame="0"])')
        asked = [url for url in page.asked if not url.startswith(("file:", "data:", "blob:"))]
        assert page.said == asked == []
