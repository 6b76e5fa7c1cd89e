"""Which figures exist, where each is drawn, and which files it reads."""

from typing import TYPE_CHECKING

from pdrom.core.registry import Registry
from pdrom.report.figures.sources import Holdings, Sources

if TYPE_CHECKING:
    from pdrom.report.figures.spec import FigureSpec

_PACKAGE = "pdrom.report.figures"

FIGURES = Registry(
    "figure",
    {
        "snapshots_and_modes": f"{_PACKAGE}.snapshots_and_modes:draw",
        "deim_iterations": f"{_PACKAGE}.deim_iterations:draw",
        "deim_entries": f"{_PACKAGE}.deim_entries:draw",
        "cloth_all_grid": f"{_PACKAGE}.runs:draw_grid",
        "bending_runs": f"{_PACKAGE}.runs:draw",
        "spring_runs": f"{_PACKAGE}.runs:draw",
        "strain_runs": f"{_PACKAGE}.runs:draw",
        "reconstruction_error": f"{_PACKAGE}.reconstruction_error:draw",
        "singular_values": f"{_PACKAGE}.singular_values:draw",
        "bar_runs": f"{_PACKAGE}.runs:draw",
        "reconstruction_error_sound": f"{_PACKAGE}.reconstruction_error:draw",
        "local_share": f"{_PACKAGE}.local_share:draw",
        "sensitivity_floor": f"{_PACKAGE}.sensitivity_floor:draw",
        "run_error": f"{_PACKAGE}.run_error:draw",
        "ladder": f"{_PACKAGE}.ladder:draw",
        "error_against_gain": f"{_PACKAGE}.error_against_gain:draw",
        "subspace_ablation": f"{_PACKAGE}.subspace_ablation:draw",
        "accuracy_cost": f"{_PACKAGE}.accuracy_cost:draw",
        "iterations": f"{_PACKAGE}.iterations:draw",
        "scaling": f"{_PACKAGE}.scaling:draw",
        "stability_map": f"{_PACKAGE}.stability_map:draw",
        "stability_sweep": f"{_PACKAGE}.stability_sweep:draw",
        "budget": f"{_PACKAGE}.budget:draw",
        "break_even": f"{_PACKAGE}.break_even:draw",
        "break_even_sizes": f"{_PACKAGE}.break_even_sizes:draw",
        "effects_cost": f"{_PACKAGE}.effects_cost:draw",
    },
)

# Kinds are methods of `Sources`; "table:name" is a file of results/tables.
_RUNS = ("mesh", "run", "rerun", "table:sensitivity")
READS: dict[str, tuple[str, ...]] = {
    "snapshots_and_modes": ("mesh", "run", "snapshots", "basis"),
    "deim_iterations": ("mesh", "basis", "sampling"),
    "deim_entries": ("mesh", "snapshots", "sampling"),
    "cloth_all_grid": _RUNS,
    "bending_runs": _RUNS,
    "spring_runs": _RUNS,
    "strain_runs": _RUNS,
    "bar_runs": _RUNS,
    "reconstruction_error": ("table:reconstruction_error",),
    "reconstruction_error_sound": ("table:reconstruction_error",),
    "singular_values": ("table:singular_values",),
    "local_share": ("table:local_share",),
    "sensitivity_floor": ("table:sensitivity",),
    "run_error": ("rerun", "table:sensitivity"),
    "ladder": ("table:ladder",),
    "error_against_gain": (
        "table:reduced_reruns",
        "table:reconstruction_error",
        "table:gain_prediction",
    ),
    "subspace_ablation": ("table:subspace_ablation",),
    "accuracy_cost": ("table:accuracy_cost",),
    "iterations": ("table:accuracy_cost",),
    "scaling": ("table:scaling", "table:scaling_fit"),
    "stability_map": ("table:stability",),
    "stability_sweep": ("table:stability",),
    "budget": ("table:budget",),
    "break_even": ("table:breakeven",),
    "break_even_sizes": ("table:breakeven",),
    "effects_cost": ("table:effects_cost", "table:effects_left_out"),
}
# Figures of the first experiment and the first method that a configuration holds.
FIRST_ONLY = ("snapshots_and_modes", "deim_iterations")
_PER_SCENE = ("mesh", "run")
_PER_GROUP = ("snapshots",)


def figure_inputs(
    name: str, spec: "FigureSpec", holdings: Holdings, results: str = "results"
) -> list[str]:
    """Files that figure ``name`` reads under a configuration, without repetition, as paths.

    Parameters
    ----------
    results : folder of the results, prefixed to every path

    Raises
    ------
    ConfigurationError
        Unknown figure.
    """
    FIGURES[name]
    sources = Sources(results, holdings)
    experiments = holdings.experiments(spec.scenes, spec.groups)
    methods = holdings.methods(spec.methods)
    if name in FIRST_ONLY:
        experiments, methods = experiments[:1], methods[:1]
    paths: list[str] = []
    for kind in READS[name]:
        if kind.startswith("table:"):
            paths.append(str(sources.table(kind.removeprefix("table:"))))
            continue
        locate = getattr(sources, kind)
        for scene, group in experiments:
            if kind in _PER_SCENE:
                paths.append(str(locate(scene)))
            elif kind in _PER_GROUP:
                paths.append(str(locate(scene, group)))
            else:
                paths += [str(locate(scene, group, method)) for method in methods]
    return list(dict.fromkeys(paths))
