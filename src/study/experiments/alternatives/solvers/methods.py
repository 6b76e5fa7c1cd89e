"""All methods by name, loaded on demand."""

from pdrom.core.registry import Registry
from pdrom.model.dynamics.system import GlobalSystem
from pdrom.model.scene import Scene
from study.experiments.alternatives.solvers.substeps import Alternative

METHODS = Registry(
    "method",
    {
        "projective": "study.experiments.alternatives.solvers.small_steps:SmallSteps",
        "anderson": "study.experiments.alternatives.solvers.anderson:Accelerated",
        "chebyshev": "study.experiments.alternatives.solvers.chebyshev:Chebyshev",
        "l-bfgs": "study.experiments.alternatives.solvers.lbfgs:QuasiNewton",
        "newton": "study.experiments.alternatives.solvers.newton:Newton",
        "xpbd": "study.experiments.alternatives.solvers.xpbd:CompliantConstraints",
        "vertex-descent": "study.experiments.alternatives.solvers.vertex_descent:VertexDescent",
        "explicit": "study.experiments.alternatives.solvers.explicit:Explicit",
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
