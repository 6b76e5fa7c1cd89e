"""A model of the library in a page: one file, which runs it as pdrom does, and its handles."""

import io
import json
from pathlib import Path

import numpy as np
import pytest
from PIL import Image
from playwright.sync_api import Page

from browser import page_at
from builders import GRAVITY, LEFT, make_scene
from node import RUN, evaluate
from pdrom import api
from pdrom.command.base import Status
from pdrom.command.main import run
from pdrom.core.errors import PdromError

FRAMES = 150
SHEET = {"kind": "cloth", "rows": 6, "columns": 5, "plane": "xz"}
SPRING = {"effect": "spring", "weight": 1e4}
BALL = {"effect": "sphere", "centre": [0.0, 0.3, 0.1], "radius": 0.2}


@pytest.fixture(scope="module")
def page(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A page beside its model and its full-order run."""
    folder = tmp_path_factory.mktemp("page")
    full = api.run(make_scene(GRAVITY, LEFT, SPRING, mesh=SHEET, frames=FRAMES), folder / "a.h5")
    api.train(full, modes=6).save(folder / "a.model.h5")
    assert run(["view", "--live", str(folder / "a.model.h5"), str(folder / "a.h5")]) == Status.DONE
    return folder / "a.model.html"


def content_of(page: Path) -> dict:
    text = page.read_text("utf-8").split('type="application/json">')[1].split("</script>")[0]
    (scene,) = json.loads(text)
    return scene["content"]


@pytest.mark.parametrize("tolerance", [0.01, None])
def test_the_page_runs_the_model_as_pdrom_does(page, tmp_path, tolerance):
    full = api.load(page.with_name("a.h5"))
    model = api.train(full, modes=6, tolerance=tolerance)
    model.view(tmp_path / "b.html")
    content = content_of(tmp_path / "b.html")
    assert content["motion"] is None
    (tmp_path / "b.js").write_text(f"pdromLive({json.dumps(content)});")
    (made,) = evaluate(RUN, tmp_path / "b.js", frames=FRAMES)
    assert (made["family"] == "all") == (tolerance is None)
    found = model.reduced.columns.B @ np.reshape(made["coordinates"], (FRAMES + 1, -1, 3))
    assert found == pytest.approx(model.run(full.scene).positions, abs=1e-9)


def test_what_no_page_shows_is_refused_by_name(page, tmp_path, capsys):
    ball = api.run(make_scene(GRAVITY, LEFT, SPRING, BALL, mesh=SHEET))
    model, out = api.load_model(page.with_name("a.model.h5")), tmp_path / "b.html"
    projections = api.train(ball, method="gappy", r=2)
    for one, full, words in (
        (model, ball, "no 'sphere'"),
        (model, model.run(model.scene), "a full-order run is required"),
        (projections, None, "reduces projections"),
    ):
        with pytest.raises(PdromError, match=words):
            one.view(out, full)
    own, recorded = str(page.with_name("a.model.h5")), str(page.with_name("a.h5"))
    for files in ([recorded], [own, own], [own, recorded, recorded], [own, "--png", str(out)]):
        assert run(["view", "--live", *files, "--out", str(out)]) == Status.FAULTY
        assert len(capsys.readouterr().err.splitlines()) == 1
    assert not out.exists()


AT_REST = "for (const id of ['again', 'play']) document.getElementById(id).click();"


def picture(page: Page) -> np.ndarray:
    """What is drawn, (height, width, 3), without the rim of the canvas."""
    page.evaluate("new Promise((seen) => requestAnimationFrame(() => requestAnimationFrame(seen)))")
    with Image.open(io.BytesIO(page.locator("#picture").screenshot())) as image:
        return np.asarray(image.convert("RGB"), dtype=int)[4:-4, 4:-4]


def topmost_handle(seen: np.ndarray) -> tuple[float, float]:
    """Row and column of the first blue pixel."""
    rows, columns = np.nonzero(seen[..., 2] - seen[..., 0] > 100)
    return float(rows[0]), float(columns[0])


@pytest.mark.slow
@pytest.mark.parametrize(("width", "address"), [(1280, ""), (400, "#plain"), (400, "?nonsense")])
def test_the_shape_fills_the_canvas_has_wires_and_goes_with_its_handle(page, width, address):
    with page_at(page.as_uri() + address, width=width, height=800) as opened:
        opened.wait_for_selector('body[data-ready="yes"]')
        opened.evaluate(AT_REST)
        wired = picture(opened)
        rows, columns = np.nonzero(wired.min(axis=2) < 200)
        assert 0.75 < max(np.ptp(rows) / len(wired), np.ptp(columns) / wired.shape[1]) < 0.95
        opened.uncheck("#ghost")
        assert np.mean(np.abs(picture(opened) - wired).max(axis=2) > 20) > 2e-3
        assert "Scene test" in opened.inner_text("#choice")
        assert opened.locator("#scene").is_hidden()
        y, x = topmost_handle(wired)
        box = opened.locator("#picture").bounding_box()
        x, y = box["x"] + 4 + x, box["y"] + 4 + y
        opened.mouse.move(x, y)
        opened.mouse.down()
        opened.mouse.move(x + 20, y + 40)
        opened.wait_for_function("Number(document.body.dataset.frame) >= 60")
        moved = np.subtract(topmost_handle(picture(opened)), topmost_handle(wired))
        assert moved == pytest.approx([40, 20], abs=6)
        assert opened.inner_text("#distance") == "your motion was not recorded"
        said = "This page has no nonsense: it shows test." if "?" in address else ""
        assert opened.inner_text("#verdict") == said
        assert opened.said == [url for url in opened.asked if not url.startswith("file:")] == []
