# One rule per table, named as it (src/pdrom/tables): each module declares columns and what it reads
for table in PLAN.tables:

    rule:
        name:
            f"{table}_table"
        input:
            **PLAN.tables.inputs(table),
        output:
            report(
                PLAN.tables.path(table),
                category="Tables",
                labels=PLAN.tables.labels(table),
            ),
        log:
            PLAN.tables.log(table),
        group:
            "report"
        params:
            **PLAN.tables.params(table),
        message:
            f"Table {table}"
        script:
            "../scripts/table.py"
