"""Report the imports, compiled functions and memory of a scene that does not list an effect.

The program gets the name of a constraint group and those of effects. It describes a scene of this
group before the code of the effects was loaded and after each of them was.
"""

import json
import sys
from collections.abc import Mapping

import numpy as np
from numba.core.dispatcher import Dispatcher

from pdrom.model.compiled.functions import Callback

SHEET = {"kind": "cloth", "rows": 5, "columns": 4}
FRAMES = 2


def arrays(thing: object, seen: set[int] | None = None) -> dict[int, np.ndarray]:
    """Every array that ``thing`` refers to, by identity."""
    seen = set() if seen is None else seen
    if id(thing) in seen:
        return {}
    seen.add(id(thing))
    if isinstance(thing, np.ndarray):
        return {id(thing): thing}
    # `compiled` counts code, and arrays of the compiler do not belong to the scene
    if isinstance(thing, (str, bytes, int, float, type, Callback)):
        return {}
    parts = list(thing.values()) if isinstance(thing, Mapping) else []
    parts += list(thing) if isinstance(thing, (list, tuple, set)) else []
    parts += list(getattr(thing, "__dict__", {}).values())
    found: dict[int, np.ndarray] = {}
    for part in parts:
        found |= arrays(part, seen)
    return found


def compiled() -> dict[str, int]:
    """Number of compiled signatures of every function of the package that is loaded."""
    found = {}
    for module in [m for name, m in sys.modules.items() if name.startswith("pdrom.")]:
        for value in vars(module).values():
            if isinstance(value, Dispatcher) and value.signatures:
                name = f"{value.py_func.__module__}.{value.py_func.__name__}"
                found[name] = len(value.signatures)
    return found


def state_of(group: str) -> dict:
    """Memory and positions of a run of a scene with one constraint group."""
    from builders import make_scene
    from pdrom.model.runs import trajectory

    scene = make_scene({"effect": group, "weight": 1e4}, mesh=SHEET, frames=FRAMES)
    run = trajectory(scene)
    held = arrays(scene)
    return {
        "arrays": len(held),
        "bytes": sum(array.nbytes for array in held.values()),
        "compiled": compiled(),
        "run": run.tobytes().hex(),
    }


def report(group: str, effects: list[str]) -> dict[str, object]:
    """Describe a scene of ``group`` before any effect was loaded and after each effect was."""
    from pdrom.model.effects import EFFECTS

    found: dict[str, object] = {"alone": state_of(group)}
    found["modules"] = sorted(name for name in sys.modules if name.startswith("pdrom."))
    for effect in effects:
        EFFECTS.load(effect)
        found[effect] = state_of(group)
    return found


if __name__ == "__main__":
    sys.stdout.write(json.dumps(report(sys.argv[1], sys.argv[2:])))
