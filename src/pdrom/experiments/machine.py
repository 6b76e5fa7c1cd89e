"""Record of the machine and of the library versions."""

from dataclasses import dataclass
from typing import Annotated

from pdrom.core.machine import machine
from pdrom.core.paths import MACHINE, File
from pdrom.core.store import write_text
from pdrom.experiments.kit.declaration import Experiment, JobSettings, Nothing


@dataclass(frozen=True)
class Outputs:
    """Files written."""

    record: Annotated[File, MACHINE]


def run(settings: JobSettings, inputs: Nothing, outputs: Outputs) -> None:
    """Write what is known of the machine."""
    write_text(machine().model_dump_json(indent=2) + "\n", outputs.record.path)


EXPERIMENT = Experiment("machine", "Record of the machine and the library versions", run)
