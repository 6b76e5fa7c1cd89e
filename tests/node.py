"""Run scripts of the page without a browser, with the Node.js of Playwright's wheel."""

import json
import subprocess
from pathlib import Path
from typing import Any

from playwright._impl._driver import compute_driver_executable

from places import ROOT

SCRIPTS = [ROOT / "src/pdrom/view/packed.js", ROOT / "src/pdrom/view/engine.js"]
# Unpacks the file of models, then evaluates the script with the given values.
MAIN = """
const { readFileSync } = require("fs");
const given = JSON.parse(readFileSync(0, "utf8"));
const text = given.scripts.map((path) => readFileSync(path, "utf8")).join("");
const { engine, packed } = new Function(
  text + "; return { engine: pdromEngine, packed: pdromPacked };")();
let content = null;
const take = (found) => { content = found; };
if (given.file) new Function("pdromLive", readFileSync(given.file, "utf8"))(take);
const { shown, ...others } = content || {};
const script = new Function("engine", "data", "given", given.script);
const plain = (_, x) => (ArrayBuffer.isView(x) ? Array.from(x) : x);
packed.unpacked(others)
  .then((data) => console.log(JSON.stringify(script(engine, data, given), plain)));
"""
RUN = """
const all = data.models.map((model) => {
  const run = new engine.Run(data, model, new engine.Basis(data, data.bases[model.basis]));
  const coordinates = [Array.from(run.z)];
  for (let frame = 0; frame < given.frames; frame++) {
    run.step();
    coordinates.push(Array.from(run.z));
  }
  return { family: model.family, elements: run.elements, coordinates };
});
return all;
"""


def evaluate(script: str, file: Path | None = None, **given: Any) -> Any:
    """Value of a script that sees the engine, the unpacked models and the given values."""
    node = compute_driver_executable()[0]
    scripts = [str(path) for path in SCRIPTS]
    data = {"scripts": scripts, "file": file and str(file), "script": script, **given}
    done = subprocess.run(
        [node, "-e", MAIN], input=json.dumps(data), capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)
