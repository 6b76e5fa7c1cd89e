"""Registry of effects by name; a module is imported only when a scene lists its effect."""

from pdrom.core.registry import Registry

EFFECTS = Registry(
    "effect",
    {
        "gravity": "pdrom.model.effects.forces:Gravity",
        "damping": "pdrom.model.effects.forces:Damping",
        "drag": "pdrom.model.effects.forces:Drag",
        "wind": "pdrom.model.effects.forces:Wind",
        "floor": "pdrom.model.effects.obstacle:Floor",
        "plane": "pdrom.model.effects.obstacle:Plane",
        "sphere": "pdrom.model.effects.obstacle:Sphere",
        "box": "pdrom.model.effects.obstacle:Box",
        "self_collision": "pdrom.model.effects.self_collision:SelfCollision",
        "kick": "pdrom.model.effects.forces:Kick",
        "velocity": "pdrom.model.effects.forces:Velocity",
        "pins": "pdrom.model.effects.hold:Pins",
        "translate": "pdrom.model.effects.hold:Translate",
        "rotate": "pdrom.model.effects.hold:Rotate",
        "keyframes": "pdrom.model.effects.hold:Keyframes",
        "poke": "pdrom.model.effects.poke:Poke",
        "bending": "pdrom.model.constraints.bending:VertexBending",
        "spring": "pdrom.model.constraints.spring:EdgeSpring",
        "strain": "pdrom.model.constraints.triangle_strain:TriangleStrain",
        "tetrahedron_strain": "pdrom.model.constraints.tetrahedron:TetrahedronStrain",
        "deformation_gradient": "pdrom.model.constraints.tetrahedron:DeformationGradient",
        "volume": "pdrom.model.constraints.volume:TetrahedronVolume",
        "area": "pdrom.model.constraints.volume:TriangleArea",
    },
)
# Groups that may be given by a material in place of their weight.
_MODULE = "pdrom.model.constraints.material"
MATERIALS = Registry(
    "material", {"deformation_gradient": f"{_MODULE}:Solid", "strain": f"{_MODULE}:Sheet"}
)
