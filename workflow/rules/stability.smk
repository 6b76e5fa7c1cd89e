# Where each method can be trusted: over scenes, time step and stiffness; and the guard at run time
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
