"""A scene outside of the theorem's premise has no bound and says why."""

import logging

from builders import make_scene
from study.experiments.bounds import compliance

STRAIN = {"effect": "strain", "weight": 1e4}


def test_a_scene_in_the_wind_has_no_bound_and_is_named(caplog):
    wind = {"effect": "wind", "velocity": [0.0, 0.0, 5.0]}
    with caplog.at_level(logging.WARNING, logger="pdrom"):
        assert compliance(make_scene(wind, STRAIN)) is None
    (record,) = caplog.records
    assert record.getMessage().startswith("scene 'test': no bounds: the force of effect 'wind'")


def test_a_scene_within_the_premise_has_one_without_a_word(caplog):
    damping = {"effect": "damping", "rate": 1.0}
    with caplog.at_level(logging.WARNING, logger="pdrom"):
        assert compliance(make_scene({"effect": "gravity"}, damping, STRAIN)) is not None
    assert not caplog.records
