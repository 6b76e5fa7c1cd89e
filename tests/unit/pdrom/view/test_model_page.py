"""The page of one model runs it as pdrom does, fills the canvas, and its handles are dragged."""

import numpy as np
import pytest

from browser import page_at, picture
from builders import GRAVITY, LEFT, make_scene
from node import RUN, evaluate
from pdrom import api
from pdrom.command.base import Status
from pdrom.command.main import run
from pdrom.core.errors import PdromError

EFFECTS = GRAVITY, LEFT, {"effect": "spring", "weight": 1e4}
SHEET = {"mesh": {"kind": "cloth", "rows": 6, "columns": 5, "plane": "xz"}, "frames": 99}
BALL = {"effect": "sphere", "centre": [0.0, 0.3, 0.1], "radius": 0.2}


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """Folder of a full-order run, its model, and their page."""
    folder = tmp_path_factory.mktemp("page")
    full = api.run(make_scene(*EFFECTS, **SHEET), folder / "a.h5")
    api.train(full, modes=6).save(folder / "a.model.h5")
    assert run(["view", "--live", str(folder / "a.model.h5"), str(folder / "a.h5")]) == Status.DONE
    return folder


def test_the_page_computes_all_elements_as_pdrom_and_shows_a_run_only_if_given(folder, tmp_path):
    full, out = api.load(folder / "a.h5"), tmp_path / "b.html"
    model = api.train(full, modes=6, tolerance=None)
    model.view(out)
    text = out.read_text("utf-8").split('"content":')[1].split("}]</script>")[0]
    assert '"motion":null' in text
    out.write_text(f"pdromLive({text});")
    z = np.reshape(evaluate(RUN, out, frames=99)[0]["coordinates"], (100, -1, 3))
    found = model.run(full.scene, solver="local_global")
    assert model.reduced.columns.B @ z == pytest.approx(found.positions, abs=1e-9)


def test_models_that_no_page_can_show_are_refused(folder, tmp_path, capsys):
    full, ball = (api.run(make_scene(*EFFECTS, *more, **SHEET)) for more in ((), (BALL,)))
    model, out = api.load_model(folder / "a.model.h5"), tmp_path / "b.html"
    projections = api.train(full, method="gappy", r=2), None, "a page cannot run"
    reduced = model, model.run(full.scene), "a full-order run is required"
    for one, shown, words in (projections, reduced, (model, ball, "no 'sphere'")):
        with pytest.raises(PdromError, match=words):
            one.view(out, shown)
    own, recorded = (str(folder / name) for name in ("a.model.h5", "a.h5"))
    for files in ([recorded], [own, own], [own, recorded, recorded], [own, "--png", str(out)]):
        assert run(["view", "--live", *files, "--out", str(out)]) == Status.FAULTY
        assert len(capsys.readouterr().err.splitlines()) == 1
    assert not out.exists()


@pytest.mark.slow
@pytest.mark.parametrize(("width", "address"), [(1280, ""), (400, "#plain"), (400, '?nosuch"%')])
def test_the_shape_fills_the_canvas_has_wires_and_follows_its_handle(folder, width, address):
    def handle():  # row and column of its first point
        seen = picture(canvas)
        return np.argwhere(seen[..., 2] - seen[..., 0] > 100)[0].astype(float)

    with page_at((folder / "a.model.html").as_uri() + address, width=width, height=800) as page:
        page.wait_for_selector('body[data-ready="yes"]')
        page.evaluate("['again', 'play'].forEach((id) => document.getElementById(id).click())")
        wired = picture(canvas := page.locator("#picture"))
        assert 0.75 < np.ptp(np.nonzero(wired.min(axis=2) < 200)[1]) / wired.shape[1] < 0.95
        page.uncheck("#ghost")
        assert np.mean(np.abs(picture(canvas) - wired).max(axis=2) > 20) > 2e-3
        assert page.inner_text("#scene + b") == "test"
        (y, x), box = handle(), canvas.bounding_box()
        page.mouse.move(box["x"] + x, box["y"] + y)
        page.mouse.down()
        page.mouse.move(box["x"] + x + 20, box["y"] + y + 40)
        page.wait_for_function("Number(document.body.dataset.frame) >= 60")
        assert handle() - [y, x] == pytest.approx([40, 20], abs=6)
        assert ('no nosuch"%: it shows test' in page.inner_text("#verdict")) == ("?" in address)
        assert page.said == [url for url in page.asked if not url.startswith("file:")] == []
