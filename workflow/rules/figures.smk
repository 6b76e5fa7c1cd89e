# One rule for each figure that src/pdrom/report/figures declares, named figure_<name>:
#   ./reproduce results/figures/<name>.pdf   makes just that figure and what it needs
for name, job in PLAN.figure_jobs.items():

    rule:
        name:
            f"figure_{name}"
        input:
            job.inputs,
        output:
            pdf=job.pdf,
            # what every browser shows
            png=report(
                job.png,
                caption="../report/figure.rst",
                category=job.category,
                labels=job.labels,
            ),
        log:
            job.log,
        group:
            "report"
        params:
            order=job.order.model_dump(mode="json"),
            rst=job.rst,
            code=job.code,
        message:
            f"Figure {name}"
        script:
            "../scripts/figure.py"
