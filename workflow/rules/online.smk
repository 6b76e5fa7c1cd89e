# Large scenes, hyper-reduced, against their own full-order run; a job is timed alone.
rule online:
    output:
        "results/online/{scene}.csv",
    log:
        "results/logs/online/{scene}.log",
    threads: workflow.cores or 1
    params:
        scene=lambda w: PLAN.online_scene(w.scene),
        settings=PLAN.online_settings(),
        protocol=PLAN.settings.timing.model_dump(),
        root=str(PLAN.root),
        content=lambda w: PLAN.mesh_content(w.scene),
        code=lambda w: PLAN.online_code(w.scene),
    message:
        "Online cost of {wildcards.scene} (alone on the machine)"
    script:
        "../scripts/online.py"


rule online_table:
    input:
        parts=PLAN.online_files(),
    output:
        report("results/tables/online.csv", category="Tables"),
    log:
        "results/logs/tables/online.log",
    params:
        name="online",
        code=PLAN.code("pdrom.tables.online"),
    message:
        "Table of online costs"
    script:
        "../scripts/table.py"
