"""Record of the machine, its units of time, and the library versions."""

from pdrom.core import machine as this
from pdrom.core.store import write_text
from study.artifact.paths import MACHINE, File
from study.experiments.kit.declaration import experiment
from study.experiments.roofline.units import units


@experiment(
    "Record of the machine and the library versions",
    reads={},
    writes={"out": MACHINE},
    alone=True,
)
def machine(out: File) -> None:
    """Measure the units, and write them to ``out`` with what is known of the machine."""
    write_text(this.machine(units()).model_dump_json(indent=2) + "\n", out.path)
