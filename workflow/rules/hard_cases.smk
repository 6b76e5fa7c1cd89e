# Every reduction at the edge of what may happen (src/pdrom/experiments/hard_cases), and the accuracy of the kernels
rule hard_cases:
    input:
        expectations="config/hard_cases.yaml",
    output:
        cases=report("results/tables/hard_cases.csv", category="Tables"),
        kernels=report("results/tables/kernel_accuracy.csv", category="Tables"),
    log:
        "results/logs/hard_cases.log",
    params:
        **PLAN.hard_cases(),
        code=PLAN.hard_cases_code(),
    message:
        "Hard cases of every reduction, and accuracy of the kernels"
    script:
        "../scripts/hard_cases.py"
