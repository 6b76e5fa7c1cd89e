from pdrom.core.logs import job_log
from pdrom.core.machine import machine
from pdrom.core.store import atomic_path

with job_log(snakemake.log[0]), atomic_path(snakemake.output[0]) as path:
    path.write_text(machine().model_dump_json(indent=2) + "\n", encoding="utf-8")
