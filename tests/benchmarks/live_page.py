"""Processor time of a frame of the page on which models run, in a headless browser.

./reproduce run python tests/benchmarks/live_page.py

A bar of 8,000 vertices with 20 modes and 200 sampled elements, drawn by WebGL2, which a machine
without a graphics card does in software, in another process of the browser.
"""

import sys
import tempfile
from pathlib import Path

from playwright.sync_api import CDPSession

ELEMENTS, MODES, WARM, FRAMES = 200, 20, 20, 200


def metrics(session: CDPSession) -> dict[str, float]:
    """What the browser counts of the page's main thread."""
    found = session.send("Performance.getMetrics")["metrics"]
    return {each["name"]: each["value"] for each in found}


def measured(address: str) -> tuple[float, float, str]:
    """Milliseconds of the main thread a frame, of its scripts, and of the model by the page."""
    from browser import page_at

    with page_at(address, 1000, 800) as page:
        session = page.context.new_cdp_session(page)
        session.send("Performance.enable", {"timeDomain": "threadTicks"})
        page.wait_for_function(f"Number(document.body.dataset.frame) >= {WARM}")
        before, first = metrics(session), int(page.get_attribute("body", "data-frame"))
        page.wait_for_function(f"Number(document.body.dataset.frame) >= {WARM + FRAMES}")
        after, last = metrics(session), int(page.get_attribute("body", "data-frame"))
        keys = ("TaskDuration", "ScriptDuration")
        task, script = (1e3 * (after[key] - before[key]) / (last - first) for key in keys)
        return task, script, page.inner_text("#ms")


def main(folder: Path) -> None:
    """Print what a frame takes."""
    from builders import make_scene
    from written_models import write_models, write_page

    effects = (
        {"effect": "gravity"},
        {"effect": "pins", "select": "left"},
        {"effect": "deformation_gradient", "weight": 1e8},
    )
    bar = {"kind": "bar", "nx": 80, "ny": 10, "nz": 10}
    scene = make_scene(*effects, mesh=bar, frames=WARM + FRAMES)
    (folder / "live").mkdir()
    every = scene.groups[0].elements // ELEMENTS
    page = write_page(folder, [write_models(scene, folder / "live", every, MODES)[0]])
    task, script, own = measured(page.as_uri())
    sys.stdout.write(
        f"{task:.1f} ms of the main thread a frame, {script:.1f} ms of them in scripts; "
        f"the model alone {own}\n"
    )


if __name__ == "__main__":
    sys.path.insert(0, str(Path(__file__).parents[1]))
    with tempfile.TemporaryDirectory() as made:
        main(Path(made))
