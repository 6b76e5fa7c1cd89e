"""Record of the machine and of the library versions."""

from pdrom.core import machine as this
from pdrom.core.paths import MACHINE, File
from pdrom.core.store import write_text
from pdrom.experiments.kit.declaration import experiment


@experiment("Record of the machine and the library versions", reads={}, writes={"out": MACHINE})
def machine(out: File) -> None:
    """Write what is known of the machine."""
    write_text(this.machine().model_dump_json(indent=2) + "\n", out.path)
