"""Keys of materials in a scene's file, and the groups and weights that they give."""

import pytest

from builders import GROUPS, make_scene
from pdrom.api import build_scene
from pdrom.core.errors import ConfigurationError

SOLID = {"effect": "deformation_gradient", "young": 2e6, "poisson": 0.25}
SHEET = {"effect": "strain", "young": 2e6, "poisson": 0.25, "thickness": 1e-3}


@pytest.mark.parametrize(
    ("material", "expected"),
    [(SOLID, {"deformation_gradient": 1.6e6, "volume": 2.4e6}),
     (SHEET, {"strain": 1.6e3, "area": 3.2e3 / 3.0}),
     (SOLID | {"poisson": 0.0}, {"deformation_gradient": 2e6})],
)  # fmt: skip
def test_a_material_becomes_groups_whose_weights_vary_together(material, expected):
    config = make_scene(
        material | {"factors": [{"select": {"kind": "component"}, "factor": 3.0}]},
        mesh=GROUPS[material["effect"]], held_out={"stiffness": 2.0},
        reduce={group: {"train": 4} for group in expected},
    ).config  # fmt: skip
    stiff, drawn = config.heldout_variant("stiffness"), config.training_variant(3)
    random = drawn.effects[0].weight / config.effects[0].weight
    for one, factor in ((config, 1.0), (stiff, 2.0), (drawn, random)):
        groups = one.effects[: len(one.groups)]
        assert one.groups == list(expected)
        assert [e.weight for e in groups] == pytest.approx([factor * w for w in expected.values()])
        assert all(e.factors[0].factor == 3.0 for e in groups)
        assert all((e.minimum, e.maximum) == (1, 1) for e in groups if hasattr(e, "minimum"))


OWN, BARE = {"weight": 1.0}, {"effect": "strain", "thickness": 1e-3}


@pytest.mark.parametrize(
    ("effects", "message"),
    [([SOLID | OWN], "weight = 1.0: not allowed with young, poisson"),
     ([SHEET | {"minimum": 0.9}], "minimum = 0.9: not allowed with young"),
     ([BARE | OWN], "weight = 1.0: not allowed with young"),
     ([SOLID | {"thickness": 1e-3}], "unknown key 'thickness' (allowed: effect, young, poisson"),
     ([SOLID | {"effect": "strain"}], "key 'thickness' is missing"),
     ([SOLID | {"poisson": 0.5}], "poisson = 0.5: Input should be less than 0.5"),
     ([SHEET | {"poisson": -0.1}], "poisson = -0.1: Input should be greater than or equal to 0"),
     ([SOLID | {"young": 1e15, "poisson": 0.49}], "young = 1e+15, poisson = 0.49: too stiff"),
     ([SOLID | {"poisson": 0.49999999999}], "young = 2e+06, poisson = 0.49999999999: too stiff"),
     ([SOLID, {"effect": "volume"} | OWN], "twice: deformation_gradient, volume, volume; young"),
     ([{"effect": "area"} | OWN, SHEET], "twice: area, strain, area; young"),
     ([{"effect": "bending", "stiffness": 1e-3}], "(bending): unknown key 'stiffness'")],
)  # fmt: skip
def test_a_faulty_material_is_refused_with_its_key_and_the_allowed_values(effects, message):
    with pytest.raises(ConfigurationError, match="build_scene: effects") as refused:
        build_scene(mesh=GROUPS["strain"], frames=2, effects=effects)
    assert message in str(refused.value)
