"""A headless browser for tests of pages; a machine without one skips them."""

import io
import shutil
from collections.abc import Iterator
from contextlib import contextmanager

import numpy as np
import pytest
from PIL import Image
from playwright.sync_api import Locator, Page, sync_playwright

BROWSERS = ("chromium", "chromium-browser", "google-chrome", "chrome")
# software rendering, so that a machine without a graphics card draws, too
OPTIONS = [
    "--no-sandbox",
    "--use-gl=angle",
    "--use-angle=swiftshader",
    "--enable-unsafe-swiftshader",
]
LIMIT = 120_000  # milliseconds after which a page without an answer has failed


def browser_or_skip() -> str:
    """Path of a browser; the test is skipped where there is none."""
    program = next(filter(None, map(shutil.which, BROWSERS)), None)
    if program is None:
        pytest.skip(f"no browser on this machine ({', '.join(BROWSERS)})")
    return program


@contextmanager
def page_at(address: str, width: int, height: int) -> Iterator[Page]:
    """Open the page at ``address``; ``said`` are its messages, ``asked`` its requested URLs."""
    with sync_playwright() as play:
        browser = play.chromium.launch(executable_path=browser_or_skip(), args=OPTIONS)
        page = browser.new_page(viewport={"width": width, "height": height})
        page.set_default_timeout(LIMIT)
        page.said, page.asked = [], []
        page.on("console", lambda message: page.said.append(message.text))
        page.on("pageerror", lambda error: page.said.append(str(error)))
        page.on("request", lambda request: page.asked.append(request.url))
        page.goto(address)
        yield page
        browser.close()


def picture(element: Locator) -> np.ndarray:
    """Pixels of an element on the screen, (height, width, 3)."""
    drawn = "new Promise((seen) => requestAnimationFrame(() => requestAnimationFrame(seen)))"
    element.page.evaluate(drawn)
    with Image.open(io.BytesIO(element.screenshot())) as image:
        return np.asarray(image.convert("RGB"), dtype=int)
