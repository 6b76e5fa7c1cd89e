"""Effects of a scene, loaded by name and only when a scene lists them."""

from pdrom.registry import Registry

EFFECTS = Registry(
    "effect",
    {
        "gravity": "pdrom.effects.gravity:Gravity",
        "damping": "pdrom.effects.damping:Damping",
        "floor": "pdrom.effects.floor:Floor",
        "kick": "pdrom.effects.kick:Kick",
        "pins": "pdrom.effects.hold:Pins",
        "translate": "pdrom.effects.hold:Translate",
        "rotate": "pdrom.effects.hold:Rotate",
        "poke": "pdrom.effects.poke:Poke",
        "bending": "pdrom.constraints.bending:VertexBending",
        "spring": "pdrom.constraints.spring:EdgeSpring",
        "strain": "pdrom.constraints.triangle_strain:TriangleStrain",
        "tetrahedron_strain": "pdrom.constraints.tetrahedron_strain:TetrahedronStrain",
        "deformation_gradient": "pdrom.constraints.deformation_gradient:DeformationGradient",
    },
)
