import json

from pdrom.core.logs import job_log
from pdrom.core.provenance import machine
from pdrom.core.store import atomic_path

with job_log(snakemake.log[0]), atomic_path(snakemake.output[0]) as path:
    path.write_text(json.dumps(machine(), indent=2, sort_keys=True) + "\n")
