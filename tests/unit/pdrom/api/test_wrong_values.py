"""A wrong value of any argument, or of any field of a run, gives a result or one line."""

import inspect
from collections.abc import Callable, Iterator
from dataclasses import fields, replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from builders import GRAVITY, LEFT
from pdrom import api
from pdrom.core.errors import PdromError
from pdrom.model.scene import SceneConfig

FRAMES = (5, 30, 3)
KEYS: dict[str, Any] = {
    "mesh": {"kind": "cloth", "rows": 6, "columns": 5, "plane": "xz"},
    "frames": 4,
    "effects": [GRAVITY, LEFT, {"effect": "spring", "weight": 1e5}],
}


def wrong_values() -> Iterator[Any]:
    yield from (None, True, False, 0, -1, 1.5, float("nan"), float("inf"), 10**30, 10**5000, 1j)
    yield from ("", "a\nb", "a\0b", "\ud800", "x" * 5000, b"a", Path(), Path("y/" * 3000))
    yield from ([], {}, (), set(), [1, "a", None], [[1], [2, 3]], {"a\nb": 1}, (i for i in "ab"))
    yield from (object(), int, len, np, lambda: None, lambda a, b, c: None, np.str_("a\nb"))
    yield from (np.empty(0), np.empty((0, 3)), np.array(1.0), np.zeros((3, 2)), np.array(["a"]))
    yield from (np.array([None, {}]), np.zeros(FRAMES, "M8[s]"), np.ma.masked_all(FRAMES))
    yield from (np.zeros(FRAMES, kind) for kind in (complex, object, bool, int, "f2", "S3"))
    yield from (np.full(FRAMES, np.nan), np.full(FRAMES, np.inf), np.zeros(FRAMES).tolist())


def require_results_or_lines(call: Callable[[Any], object], *more: Any) -> None:
    for value in (*wrong_values(), *more):
        try:
            call(value)
        except PdromError as error:
            message = str(error)
            if len(message.splitlines()) != 1:
                pytest.fail(f"not one line: {message}")


@pytest.fixture(scope="module")
def known() -> dict[str, Any]:
    """A right value of every argument."""
    full = api.run(api.build_scene(**KEYS))
    model = api.train(full, modes=4, converged=False, tolerance=None)
    return KEYS | {
        "full": full, "others": full, "reference": full, "runs": full, "run": full, "model": model,
        "group": "spring", "method": "pod", "r": 1, "modes": 4, "tolerance": None,
        "converged": False, "folder": ".", "out": "out.h5", "path": "path.h5", "unchecked": False,
    }  # fmt: skip


PLACED = ("path", "full", "others", "reference", "runs")
ARGUMENTS = [
    (name, key)
    for name in filter(str.islower, api.__all__)
    for parameter in inspect.signature(getattr(api, name)).parameters
    for key in (SceneConfig.model_fields if parameter == "keys" else [parameter])
]


@pytest.mark.parametrize(("name", "key"), ARGUMENTS)
def test_wrong_arguments_give_a_result_or_one_line(known, tmp_path, monkeypatch, capfd, name, key):
    monkeypatch.chdir(tmp_path)
    function, right = getattr(api, name), dict(known)
    if name in ("cost", "run"):
        right["scene"] = known["full"].scene
    taken = inspect.signature(function).parameters
    right = {each: right[each] for each in (KEYS if "keys" in taken else taken) if each in right}
    if name == "train" and key not in ("group", "method", "r"):
        del right["group"], right["method"], right["r"]

    def call(value: Any) -> None:
        given = right | {key: value}
        many = {"runs", "others"} & {*taken}
        function(*[given.pop(each) for each in [*given] if many and each in PLACED], **given)

    require_results_or_lines(call)
    assert capfd.readouterr() == ("", "")  # also of compiled libraries, such as LAPACK


def use(run: Any) -> None:
    """Do with a run all that the package does with it."""
    repr(run)
    api.view("page.html", run)
    api.train(run, method="pod", r=1)
    api.plot(run, run)
    api.save(run, "run.h5")


@pytest.mark.parametrize("kind", ["run", "snapshots"])
def test_wrong_fields_of_a_run_give_a_result_or_one_line(known, tmp_path, monkeypatch, capfd, kind):
    monkeypatch.chdir(tmp_path)
    full = known["full"]
    record, tried = full, use
    if kind == "snapshots":
        record = full.snapshots["spring"]
        tried = lambda own: use(replace(full, snapshots={"spring": own}))  # noqa: E731
    for field in fields(record):
        right, spoilt = np.array(getattr(record, field.name)), ()
        if right.dtype.kind == "f":
            spoilt = right.astype(complex), right.astype(object), right * np.nan, right.tolist()
        require_results_or_lines(
            lambda value, name=field.name: tried(replace(record, **{name: value})), *spoilt
        )
    assert capfd.readouterr() == ("", "")


@pytest.mark.parametrize("argument", ["scene", "out", "on_frame", "iterations", "solver", "path"])
def test_a_wrong_argument_of_a_model_gives_a_result_or_one_line(
    known, tmp_path, monkeypatch, capfd, argument
):
    monkeypatch.chdir(tmp_path)
    model, scene = known["model"], known["full"].scene
    if argument == "path":
        require_results_or_lines(model.save)
    else:
        require_results_or_lines(lambda value: model.run(**{"scene": scene, argument: value}))
    assert capfd.readouterr() == ("", "")
