# Large scenes, hyper-reduced, against their own full-order run; a job is timed alone.
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
