"""Lengths of names: what a user chooses is short enough for every file that is named after it."""

import pytest

from pdrom.core.yamlfile import MAX_NAME, MAX_PATH, check_lengths
from pdrom.model.effects import EFFECTS
from study.artifact import paths
from study.artifact.paths import Place

PLACES = [place for place in vars(paths).values() if isinstance(place, Place)]
# A name on its way to its place, with its checksum: ".", ".0123456789ab" and ".blake2b".
TEMPORARY = 1 + 13 + 8
LONGEST = {
    "scene": 64 * "s", "method": 64 * "m", "group": max(EFFECTS, key=len), "run": "heldout",
    "mesh": 40 * "m" + "_01234567", "basis": "mass-mean-in-modes-vectorised",
    "factor": "0.123456789", "name": 64 * "n",
}  # fmt: skip


@pytest.mark.parametrize("place", PLACES, ids=[place.pattern for place in PLACES])
def test_no_result_has_a_longer_name_than_systems_take(place):
    labels = {label: LONGEST[label] for label in place.labels}
    names = place.at("results/studies/" + 60 * "a", **labels).split("/")
    assert max(map(len, names)) + TEMPORARY <= MAX_NAME
    # a log has all labels in its name
    assert len("_".join(labels.values())) + len(".log") <= MAX_NAME


def test_bytes_are_counted_not_letters():
    check_lengths("a/" + 255 * "b")
    check_lengths("a/" * 2000)
    for path, words in ((128 * "é", f"at most {MAX_NAME} bytes"), (2048 * "a/", str(MAX_PATH))):
        with pytest.raises(ValueError, match=words):
            check_lengths(path)
