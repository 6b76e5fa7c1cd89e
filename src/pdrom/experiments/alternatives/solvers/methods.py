"""All methods by name, loaded on demand."""

from pdrom.core.registry import Registry
from pdrom.experiments.alternatives.solvers.substeps import Alternative
from pdrom.model.dynamics.system import GlobalSystem
from pdrom.model.scene import Scene

METHODS = Registry(
    "method",
    {
        "projective": "pdrom.experiments.alternatives.solvers.small_steps:SmallSteps",
        "anderson": "pdrom.experiments.alternatives.solvers.anderson:Accelerated",
        "chebyshev": "pdrom.experiments.alternatives.solvers.chebyshev:Chebyshev",
        "l-bfgs": "pdrom.experiments.alternatives.solvers.lbfgs:QuasiNewton",
        "newton": "pdrom.experiments.alternatives.solvers.newton:Newton",
        "xpbd": "pdrom.experiments.alternatives.solvers.xpbd:CompliantConstraints",
        "vertex-descent": "pdrom.experiments.alternatives.solvers.vertex_descent:VertexDescent",
        "explicit": "pdrom.experiments.alternatives.solvers.explicit:Explicit",
    },
)


def alternative(
    name: str,
    scene: Scene,
    substeps: int,
    iterations: int = 1,
    system: GlobalSystem | None = None,
) -> Alternative:
    """Step loop of a scene by the method ``name``: so many ``substeps`` a frame, see `Alternative`.

    Each of them does ``iterations``; ``system`` is a factored one of equal substeps, to be shared.

    Raises
    ------
    ConfigurationError, SceneError
        Unknown name, a group or a force that the method does not take.
    """
    made: Alternative = METHODS.load(name)(scene, substeps, iterations, system)
    return made
