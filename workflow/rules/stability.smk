# Where each method can be trusted: over scenes, time step and stiffness; and the guard at run time
rule stability:
    input:
        mesh=lambda w: PLAN.mesh_path(w.scene),
        bases=lambda w: PLAN.bases_of(w.scene),
        samplings=lambda w: PLAN.samplings_of(w.scene),
        hyper=lambda w: PLAN.hyper_of(w.scene),
    output:
        "results/stability/{scene}.csv",
    log:
        "results/logs/stability/{scene}.log",
    params:
        scene=lambda w: PLAN.scene_config(w.scene),
        methods=PLAN.method_specs(),
        settings=PLAN.stability_settings(),
        blowup_extent=PLAN.settings.blowup_extent,
        solver=PLAN.settings.solver,
        code=lambda w: PLAN.scene_code("pdrom.experiments.stability", w.scene),
    message:
        "Time step and stiffness of {wildcards.scene}"
    script:
        "../scripts/stability.py"


rule stability_table:
    input:
        fom=expand("results/fom/{scene}/train.h5", scene=PLAN.study.scenes),
        reruns=PLAN.per_experiment("reruns", ".csv"),
        hyper=PLAN.hyper("models.csv"),
        sweeps=PLAN.sweeps,
        reduced_reruns="results/tables/reduced_reruns.csv",
    output:
        report("results/tables/stability.csv", category="Tables"),
    log:
        "results/logs/tables/stability.log",
    params:
        name="stability",
        time_steps=PLAN.time_steps(),
        wrong=PLAN.settings.stability.wrong,
        left=PLAN.settings.stability.left,
        code=PLAN.code("pdrom.tables.stability"),
    message:
        "Table of the stability map"
    script:
        "../scripts/table.py"


# Its runs are timed, so it runs alone.
rule guard:
    input:
        mesh=PLAN.guard_files("mesh"),
        fom=PLAN.guard_files("fom"),
        basis=PLAN.guard_files("basis"),
        sampling=PLAN.guard_files("sampling"),
    output:
        report("results/tables/guard.csv", category="Tables"),
    log:
        "results/logs/tables/guard.log",
    threads: workflow.cores or 1
    params:
        cases=PLAN.guard_cases(),
        guard=PLAN.guard_settings(),
        repeats=PLAN.settings.guard.repeats,
        blowup_extent=PLAN.settings.blowup_extent,
        solver=PLAN.settings.solver,
        files=lambda w: [
            dict(zip(("mesh", "fom", "basis", "sampling"), paths))
            for paths in zip(*map(PLAN.guard_files, ("mesh", "fom", "basis", "sampling")))
        ],
        code=PLAN.guard_code(),
    message:
        "Guard at run time: what falling back buys (alone on the machine)"
    script:
        "../scripts/guard.py"
