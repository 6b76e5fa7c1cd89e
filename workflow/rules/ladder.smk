# From the published choices to sound ones, one ingredient at a time (config/ladder.yaml)
rule ladder_table:
    input:
        parts=PLAN.ladder_files(),
    output:
        report("results/tables/ladder.csv", category="Tables"),
    log:
        "results/logs/tables/ladder.log",
    params:
        name="ladder",
        code=PLAN.code("pdrom.tables.ladder"),
    message:
        "Table of the ladder"
    script:
        "../scripts/table.py"
