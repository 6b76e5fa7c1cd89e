# Tables of the study, columns as in src/pdrom/tables/columns.py


rule singular_values_table:
    input:
        bases=PLAN.reference_bases(),
    output:
        report("results/tables/singular_values.csv", category="Tables"),
    log:
        "results/logs/tables/singular_values.log",
    params:
        name="singular_values",
        code=PLAN.code("pdrom.tables.singular_values"),
    message:
        "Table of singular values"
    script:
        "../scripts/table.py"


rule reconstruction_error_table:
    input:
        errors=PLAN.per_experiment("sampling", ".csv"),
    output:
        report("results/tables/reconstruction_error.csv", category="Tables"),
    log:
        "results/logs/tables/reconstruction_error.log",
    params:
        name="reconstruction_error",
        code=PLAN.code("pdrom.tables.reconstruction_error"),
    message:
        "Table of reconstruction errors"
    script:
        "../scripts/table.py"


rule sensitivity_table:
    input:
        scenes=PLAN.per_scene("sensitivity", ".csv"),
    output:
        report("results/tables/sensitivity.csv", category="Tables"),
    log:
        "results/logs/tables/sensitivity.log",
    params:
        name="sensitivity",
        code=PLAN.code("pdrom.tables.sensitivity"),
    message:
        "Table of sensitivity floors"
    script:
        "../scripts/table.py"


rule local_share_table:
    input:
        timings=PLAN.per_scene("timings", ".csv"),
    output:
        report("results/tables/local_share.csv", category="Tables"),
    log:
        "results/logs/tables/local_share.log",
    params:
        name="local_share",
        code=PLAN.code("pdrom.tables.local_share"),
    message:
        "Table of local shares"
    script:
        "../scripts/table.py"


rule reduced_reruns_table:
    input:
        runs=PLAN.per_experiment("reruns", ".h5"),
        tables=PLAN.per_experiment("reruns", ".csv"),
        hyper=PLAN.hyper("models.h5"),
        hyper_tables=PLAN.hyper("models.csv"),
        timings=PLAN.per_scene("timings", ".csv"),
        sensitivity="results/tables/sensitivity.csv",
    output:
        report("results/tables/reduced_reruns.csv", category="Tables"),
    log:
        "results/logs/tables/reduced_reruns.log",
    params:
        name="reduced_reruns",
        perturbation=PLAN.settings.sensitivity.reference,
        threshold=PLAN.settings.sensitivity.threshold,
        code=PLAN.code("pdrom.tables.reduced_reruns"),
    message:
        "Table of reduced reruns"
    script:
        "../scripts/table.py"


rule heldout_reruns_table:
    input:
        runs=PLAN.per_experiment("reruns", ".h5"),
        tables=PLAN.per_experiment("reruns", "_heldout.csv"),
        hyper=PLAN.hyper("models.h5"),
        hyper_tables=PLAN.hyper("models_heldout.csv"),
        sensitivity="results/tables/sensitivity.csv",
    output:
        report("results/tables/heldout_reruns.csv", category="Tables"),
    log:
        "results/logs/tables/heldout_reruns.log",
    params:
        name="heldout_reruns",
        threshold=PLAN.settings.sensitivity.threshold,
        code=PLAN.code("pdrom.tables.reduced_reruns"),
    message:
        "Table of reruns on held-out motions"
    script:
        "../scripts/table.py"


rule accuracy_cost_table:
    input:
        reruns="results/tables/reduced_reruns.csv",
        timings=PLAN.per_scene("timings", ".csv"),
        iterations=PLAN.per_scene("iterations", ".csv"),
    output:
        report("results/tables/accuracy_cost.csv", category="Tables"),
    log:
        "results/logs/tables/accuracy_cost.log",
    params:
        name="accuracy_cost",
        iterations={name: scene.iterations for name, scene in PLAN.study.scenes.items()},
        code=PLAN.code("pdrom.tables.accuracy_cost"),
    message:
        "Table of accuracy against cost"
    script:
        "../scripts/table.py"


rule scaling_table:
    input:
        parts=PLAN.scaling_files(),
    output:
        report("results/tables/scaling.csv", category="Tables"),
    log:
        "results/logs/tables/scaling.log",
    params:
        name="scaling",
        code=PLAN.code("pdrom.tables.scaling"),
    message:
        "Table of cost against mesh size"
    script:
        "../scripts/table.py"


rule targets_table:
    input:
        reruns="results/tables/reduced_reruns.csv",
        reconstruction="results/tables/reconstruction_error.csv",
    output:
        report("results/tables/targets.csv", category="Tables"),
    log:
        "results/logs/tables/targets.log",
    params:
        name="targets",
        code=PLAN.code("pdrom.tables.targets"),
    message:
        "Table of sampled methods against the orthogonal projection"
    script:
        "../scripts/table.py"


rule budget_table:
    input:
        points="results/tables/accuracy_cost.csv",
    output:
        report("results/tables/budget.csv", category="Tables"),
    log:
        "results/logs/tables/budget.log",
    params:
        name="budget",
        budgets=list(PLAN.settings.budgets),
        code=PLAN.code("pdrom.tables.budget"),
    message:
        "Table of what a frame's budget buys"
    script:
        "../scripts/table.py"


rule scaling_fit_table:
    input:
        table="results/tables/scaling.csv",
    output:
        report("results/tables/scaling_fit.csv", category="Tables"),
    log:
        "results/logs/tables/scaling_fit.log",
    params:
        name="scaling_fit",
        code=PLAN.code("pdrom.tables.scaling"),
    message:
        "Exponents of cost against mesh size"
    script:
        "../scripts/table.py"


rule breakeven_table:
    input:
        parts=PLAN.breakeven_files(),
    output:
        report("results/tables/breakeven.csv", category="Tables"),
    log:
        "results/logs/tables/breakeven.log",
    params:
        name="breakeven",
        code=PLAN.code("pdrom.tables.breakeven"),
    message:
        "Table of break-even sizes"
    script:
        "../scripts/table.py"


rule effects_cost_table:
    input:
        parts=PLAN.per_scene("effects", ".csv"),
    output:
        report("results/tables/effects_cost.csv", category="Tables"),
    log:
        "results/logs/tables/effects_cost.log",
    params:
        name="effects_cost",
        code=PLAN.code("pdrom.tables.effects_cost"),
    message:
        "Table of the cost of each effect"
    script:
        "../scripts/table.py"


rule effects_left_out_table:
    input:
        parts=PLAN.per_scene("left_out", ".csv"),
    output:
        report("results/tables/effects_left_out.csv", category="Tables"),
    log:
        "results/logs/tables/effects_left_out.log",
    params:
        name="effects_left_out",
        code=PLAN.code("pdrom.tables.effects_cost"),
    message:
        "Table of scenes without some of their effects"
    script:
        "../scripts/table.py"


rule gain_prediction_table:
    input:
        reruns="results/tables/reduced_reruns.csv",
        reconstruction="results/tables/reconstruction_error.csv",
    output:
        report("results/tables/gain_prediction.csv", category="Tables"),
    log:
        "results/logs/tables/gain_prediction.log",
    params:
        name="gain_prediction",
        code=PLAN.code("pdrom.tables.gain_prediction"),
    message:
        "Table of what the gain predicts"
    script:
        "../scripts/table.py"


rule claims_table:
    input:
        rules="config/claims.yaml",
        tables=[
            "results/tables/local_share.csv",
            "results/tables/breakeven.csv",
            "results/tables/reduced_reruns.csv",
            "results/tables/singular_values.csv",
            "results/tables/reconstruction_error.csv",
        ],
    output:
        report("results/tables/claims.csv", category="Tables"),
    log:
        "results/logs/tables/claims.log",
    params:
        content=PLAN.digest("config/claims.yaml"),
        code=PLAN.code("pdrom.report.decide"),
    message:
        "Verdicts on the claims of the paper"
    script:
        "../scripts/claims.py"


# Tables that an experiment writes as they are
for name, place in PLAN.measured_tables.items():

    rule:
        name:
            f"{name}_table"
        input:
            part=place,
        output:
            report(f"results/tables/{name}.csv", category="Tables"),
        log:
            f"results/logs/tables/{name}.log",
        params:
            name=name,
            code=PLAN.code("pdrom.tables.make"),
        message:
            f"Table {name}"
        script:
            "../scripts/table.py"
