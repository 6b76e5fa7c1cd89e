"""All methods by name, loaded on demand."""

from pdrom.core.registry import Registry
from pdrom.model.alternatives.substeps import Alternative
from pdrom.model.dynamics.system import GlobalSystem
from pdrom.model.scene import Scene

METHODS = Registry(
    "method",
    {
        "projective": "pdrom.model.alternatives.small_steps:SmallSteps",
        "anderson": "pdrom.model.alternatives.anderson:Accelerated",
        "l-bfgs": "pdrom.model.alternatives.lbfgs:QuasiNewton",
        "newton": "pdrom.model.alternatives.newton:Newton",
        "xpbd": "pdrom.model.alternatives.xpbd:CompliantConstraints",
        "vertex-descent": "pdrom.model.alternatives.vertex_descent:VertexDescent",
        "explicit": "pdrom.model.alternatives.explicit:Explicit",
    },
)


def alternative(
    name: str,
    scene: Scene,
    substeps: int,
    iterations: int = 1,
    system: GlobalSystem | None = None,
) -> Alternative:
    """Step loop of a scene by the method ``name``, see `Alternative`.

    Raises
    ------
    ConfigurationError, SceneError
        Unknown name, a group or a force that the method does not take.
    """
    made: Alternative = METHODS.load(name)(scene, substeps, iterations, system)
    return made
