# One rule per experiment, named as it (src/pdrom/experiments): each module declares what it reads, writes and depends on
for experiment in PLAN.jobs.experiments:

    rule:
        name:
            experiment.name
        input:
            **PLAN.jobs.inputs(experiment),
        output:
            **PLAN.jobs.outputs(experiment),
        log:
            PLAN.jobs.log(experiment),
        group:
            PLAN.jobs.group(experiment)
        threads: PLAN.jobs.threads(experiment, CORES)
        resources:
            **PLAN.jobs.resources(experiment),
        params:
            **PLAN.jobs.params(experiment),
        message:
            PLAN.jobs.message(experiment)
        script:
            "../scripts/experiment.py"
