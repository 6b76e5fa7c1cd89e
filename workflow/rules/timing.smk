# Timings run alone: a job that takes every core has no neighbour.
rule timing:
    input:
        mesh=lambda w: PLAN.mesh_path(w.scene),
        fom="results/fom/{scene}/train.h5",
        bases=lambda w: PLAN.bases_of(w.scene),
        samplings=lambda w: PLAN.samplings_of(w.scene),
        hyper=lambda w: PLAN.hyper_of(w.scene),
    output:
        frames="results/timings/{scene}.csv",
        breakeven="results/breakeven/{scene}.csv",
        effects="results/effects/{scene}.csv",
        left_out="results/left_out/{scene}.csv",
    log:
        "results/logs/timing/{scene}.log",
    threads: workflow.cores or 1
    params:
        scene=lambda w: PLAN.scene_config(w.scene),
        methods=PLAN.method_specs(),
        ranks=list(PLAN.settings.ranks),
        counts=list(PLAN.settings.iterations.counts),
        window=PLAN.settings.iterations.anderson_window,
        protocol=PLAN.settings.timing.model_dump(),
        solver=PLAN.settings.solver,
        threads=PLAN.settings.threads,
        code=lambda w: PLAN.scene_code("pdrom.experiments.timing", w.scene),
    message:
        "Timings of {wildcards.scene} (alone on the machine)"
    script:
        "../scripts/timing.py"


rule scaling:
    output:
        iterations="results/scaling/{scene}/x{factor}.csv",
        breakeven="results/breakeven/{scene}/x{factor}.csv",
    log:
        "results/logs/scaling/{scene}_x{factor}.log",
    threads: workflow.cores or 1
    params:
        scene=lambda w: PLAN.scene_config(w.scene),
        methods=PLAN.scaling_specs(),
        settings=PLAN.scaling_settings(),
        solver=PLAN.settings.solver,
        root=str(PLAN.root),
        content=lambda w: PLAN.mesh_content(w.scene),
        factor=lambda w: float(w.factor),
        code=lambda w: PLAN.scene_code(
            "pdrom.experiments.scaling", w.scene, PLAN.scaling_methods.values()
        ),
    message:
        "Cost of {wildcards.scene} on a mesh with {wildcards.factor} times the vertices along a side (alone)"
    script:
        "../scripts/scaling.py"


rule offline:
    output:
        report("results/tables/offline_cost.csv", category="Tables"),
    log:
        "results/logs/tables/offline_cost.log",
    threads: workflow.cores or 1
    params:
        settings=PLAN.settings.offline.model_dump(mode="json"),
        code=PLAN.code("pdrom.experiments.offline"),
    message:
        "Cost of the offline algorithms (alone on the machine)"
    script:
        "../scripts/offline.py"


rule machine:
    output:
        "results/machine.json",
    log:
        "results/logs/machine.log",
    params:
        code=PLAN.code("pdrom.core.machine"),
    message:
        "Record of the machine and the library versions"
    script:
        "../scripts/machine.py"
