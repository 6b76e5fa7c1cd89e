"""The page of models: one file, scenes next to it, and it works in a real browser."""

import re
from pathlib import Path

import numpy as np
import pytest
from playwright.sync_api import Page

from browser import page_at, picture
from builders import make_scene
from pdrom.core.errors import StorageError
from pdrom.core.store import write_text
from written_models import write_models, write_page


def test_scenes_with_models_are_named_in_order_and_a_damaged_file_is_refused(tmp_path):
    one, without, two = (tmp_path / "live" / f"{name}.js" for name in ("one", "without", "two"))
    for file in (one, two):
        write_text(f'pdromLive({{"format":1,"scene":"{file.stem}","more":0}});\n', file)
    write_text('pdromLive({"format":1,"scene":"without","models":[]});\n', without)
    text = write_page(tmp_path, [one, without, two]).read_text("utf-8")
    scene = '{{"scene":"{0}","words":"{0}","file":"live/{0}.js"}}'
    assert f"[{scene.format('one')},{scene.format('two')}]" in text
    two.write_text("damaged", encoding="utf-8")
    with pytest.raises(StorageError, match=r"two\.js"):
        write_page(tmp_path, [one, two])


def write_sheet(folder: Path) -> Path:
    """Write models of a sheet that hangs from one side for the page of ``folder``."""
    (folder / "live").mkdir()
    pull, pins = {"effect": "gravity"}, {"effect": "pins", "select": "left"}
    sheet = {"kind": "cloth", "rows": 8, "columns": 8, "plane": "xz"}
    scene = make_scene(pull, pins, {"effect": "spring", "weight": 1e4}, mesh=sheet, frames=120)
    return write_models(scene, folder / "live", every=1)[0]


@pytest.mark.slow
def test_of_scenes_selected_quickly_the_last_is_shown_and_a_missing_one_is_named(tmp_path):
    """Files may arrive in any order; the page continues after a missing file."""
    one = write_sheet(tmp_path)
    files = [one.with_name(f"{name}.js") for name in "abcd"]
    for file in files:
        named = f'"scene":"{file.stem}","title":"{file.stem.upper()}"'
        text = re.sub(r'"scene":"\w+","title":"[^"]*"', named, one.read_text("utf-8"), count=1)
        write_text(text, file)
    path = write_page(tmp_path, files)
    whole = files[3].read_text()
    files[3].unlink()
    choose = """scenes => scenes.forEach((scene) => {
      document.getElementById("scene").value = scene;
      document.getElementById("scene").dispatchEvent(new Event("change"));
    })"""
    with page_at(path.as_uri(), width=900, height=800) as page:
        for chosen, title in (([1, 2], "C."), ([0, 1, 0], "A.")):
            page.evaluate(choose, chosen)
            page.wait_for_selector('body[data-ready="yes"]')
            assert page.inner_text("#about").startswith(title)
        for content in (None, whole[: len(whole) // 2], files[0].read_text()):
            if content is not None:  # missing, truncated, of another scene
                files[3].write_text(content)
            page.evaluate(choose, [3])
            page.wait_for_selector("#verdict.bad")
            assert "live/d.js" in page.inner_text("#verdict")
            page.evaluate(choose, [1])
            page.wait_for_selector('body[data-ready="yes"]')
        assert page.inner_text("#about").startswith("B.")


LIFTED = """
(size) => {
  const [canvas, other] = [1, 2].map(() => document.createElement("canvas"));
  canvas.style.width = canvas.style.height = "200px";
  document.body.append(canvas);
  const drawing = new pdromDrawing.Drawing(canvas, { plain: location.hash === "#plain" });
  const layer = drawing.add(new pdromDrawing.Layer({ triangles: Uint32Array.of(0, 1, 2), n: 3 }));
  const B = new Float32Array(3 * size), z = new Float32Array(3 * size);
  for (let v = 0; v < 3; v++) B[size * v + size - 1 - v] = z[3 * (size - 1 - v) + v] = 1;
  layer.lifted(B, size, (out) => out.set([1, 0, 0, 0, 1, 0, 0, 0, 1]));
  layer.move(z);
  drawing.camera.look([0, 0, 0], 2);
  drawing.draw();
  const copy = other.getContext("2d");
  copy.drawImage(canvas, 0, 0);
  canvas.remove();
  const { data } = copy.getImageData(0, 0, 200, 150);
  return data.filter((value, i) => i % 4 === 3 && value > 0).length;
}
"""


@pytest.mark.slow
@pytest.mark.parametrize("drawn", ["", "#plain"], ids=["WebGL2", "canvas"])
def test_a_model_runs_is_drawn_and_follows_its_handle(drawn, tmp_path):
    path = write_page(tmp_path, [write_sheet(tmp_path)])
    with page_at(path.as_uri() + drawn, width=900, height=800) as page:
        page.wait_for_selector('body[data-ready="yes"]')
        use(page)


def use(opened: Page) -> None:
    """Run a model to its end, move a handle by a key, and turn the picture by a pointer."""

    def after(frame: int) -> None:
        opened.wait_for_function(f"Number(document.body.dataset.frame) >= {frame}")

    after(2)
    seen = picture(canvas := opened.locator("#picture"))
    assert np.mean(seen.min(axis=2) < 200) > 0.005
    after(25)
    assert np.mean(np.abs(picture(canvas) - seen).max(axis=2) > 30) > 1e-3
    assert opened.inner_text("#verdict") == ""
    after(125)
    told = "document.getElementById('distance').textContent.includes('{}')"
    opened.wait_for_function(told.format("ended"))
    opened.click("#again")
    opened.wait_for_function(told.format("%"))
    # a key that is pressed and released moves a handle
    opened.focus("#handles button")
    opened.keyboard.press("ArrowUp")
    opened.wait_for_function(
        "document.getElementById('distance').textContent === 'unknown: you moved a handle'"
    )
    opened.get_by_role("button", name="Let go of left").click()
    opened.get_by_role("button", name="Hold left").wait_for()
    # a pointer turns the picture if it is on no handle, for example in the corner
    opened.click("#again")
    opened.click("#play")
    box, before = canvas.bounding_box(), picture(canvas)
    opened.mouse.move(box["x"] + 10, box["y"] + box["height"] - 10)
    opened.mouse.down()
    opened.mouse.move(box["x"] + 200, box["y"] + box["height"] - 40)
    opened.mouse.up()
    assert np.mean(np.abs(picture(canvas) - before).max(axis=2) > 30) > 1e-3
    assert opened.inner_text("#distance") != "unknown: you moved a handle"
    # more coordinates than a graphics card accepts are drawn, too
    few, many = (opened.evaluate(LIFTED, size) for size in (12, 204))
    assert few == many > 100
    assert [url for url in opened.asked if not url.startswith(("file:", "data:", "blob:"))] == []
    assert opened.said == []
