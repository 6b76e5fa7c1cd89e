"""Time step loops in new processes.

Times depend on the addresses of arrays and code in a process, which changes them more than repeats
differ. Only new processes (`in_processes`) show this, because a fork inherits the addresses.
"""

import logging
import pickle
import subprocess
import sys
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path
from tempfile import TemporaryDirectory
from time import perf_counter, process_time
from typing import Annotated, Any

import numpy as np
from pydantic import Field

from pdrom.core.errors import PdromError
from pdrom.core.store.checksum import damaged_set_aside
from pdrom.core.yamlfile import ConfigModel
from pdrom.reduction.timing import Variant, measure
from study.artifact import planned
from study.experiments.kit.base import Count, Repeats

log = logging.getLogger(__name__)


class Protocol(ConfigModel):
    """Settings of a timing: ``warmup`` untimed and ``repeats`` timed runs of ``frames`` frames."""

    frames: Count = 10
    warmup: Annotated[int, Field(ge=0, le=1000)] = 1
    repeats: Repeats = 3


class Processes(Protocol):
    """Settings of a timing done in each of ``processes`` new processes, one after the other."""

    frames: Count = 4
    processes: Repeats = 10


def in_processes(
    cases: Sequence[Callable[[], Iterable[Variant]]], asked: Processes
) -> list[dict[str, Any]]:
    """Time all variants in several new processes; return a row per variant and process.

    The processes run one after the other, each with the variants in another random order. They get
    the pickled functions ``cases``, which make the variants. Column ``processor_share`` is the
    processor time of a process relative to its duration. Raises PdromError if a process fails.
    """
    rows: list[dict[str, Any]] = []
    command = [sys.executable, "-m", planned.__name__, __name__]
    with TemporaryDirectory() as folder:
        given, answer = Path(folder, "cases.pickle"), Path(folder, "rows.pickle")
        given.write_bytes(pickle.dumps((cases, asked)))
        for process in range(1, asked.processes + 1):
            ended = subprocess.run(
                [*command, str(given), str(answer), str(process)],
                stdin=subprocess.DEVNULL, capture_output=True, text=True, check=False,
            )  # fmt: skip
            if ended.returncode:
                last = ended.stderr.strip().rpartition("\n")[2]
                raise PdromError(
                    f"a process that times frames failed (exit code {ended.returncode}): {last}"
                )
            rows += pickle.loads(answer.read_bytes())
            log.info("process %d of %d", process, asked.processes)
    return rows


def _in_this_process(given: str, answer: str, process: str) -> None:
    """Time variants made by the functions in the file ``given``; write rows to ``answer``."""
    with damaged_set_aside():  # damaged files are renamed when read, as in the parent process
        cases, asked = pickle.loads(Path(given).read_bytes())
        variants = [variant for case in cases for variant in case()]
        order = np.random.default_rng(int(process)).permutation(len(variants))
        begin, used = perf_counter(), process_time()
        measured = measure([variants[i] for i in order], asked.warmup, asked.repeats)
        share = (process_time() - used) / (perf_counter() - begin)
    told = {"process": int(process), "processor_share": share}
    rows = [{**measured[i], **told} for i in np.argsort(order)]
    Path(answer).write_bytes(pickle.dumps(rows))


if __name__ == "__main__":
    _in_this_process(*sys.argv[1:])
