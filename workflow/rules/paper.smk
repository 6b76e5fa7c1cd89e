# tables and figures -> manuscript; no number is typed in its source
rule paper_inputs:
    input:
        source=PLAN.paper.sources,
        references="paper/references.bib",
        tables=PLAN.tables.paths,
        machine=PLAN.paper.machine,
    output:
        PLAN.paper.inputs,
    log:
        f"{PLAN.results}/logs/paper/inputs.log",
    group:
        "report"
    params:
        facts=PLAN.paper.facts.model_dump(mode="json"),
        content=PLAN.digest(*PLAN.paper.sources, "paper/references.bib"),
        code=PLAN.code("pdrom.report.paper.build"),
    message:
        "Numbers, tables and references of the manuscript"
    script:
        "../scripts/paper_inputs.py"


rule paper:
    input:
        source=PLAN.paper.sources,
        inputs=rules.paper_inputs.output,
        figures=PLAN.figures,
    output:
        report(FOLDERS.manuscript, category="Manuscript"),
    log:
        f"{PLAN.results}/logs/paper/main.log",
    group:
        "report"
    params:
        facts=PLAN.paper.facts.model_dump(mode="json"),
        content=PLAN.digest(*PLAN.paper.sources),
        code=PLAN.code("pdrom.report.paper.build"),
    message:
        f"Manuscript {FOLDERS.manuscript}"
    script:
        "../scripts/paper.py"
