from pdrom.core.logs import job_log
from pdrom.core.machine import machine
from pdrom.core.store import write_text

with job_log(snakemake.log[0]):
    write_text(machine().model_dump_json(indent=2) + "\n", snakemake.output[0])
