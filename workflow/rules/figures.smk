# One rule per entry of config/figures.yaml, named figure_<name>:
#   ./reproduce results/figures/<name>.pdf   makes just that figure and what it needs
for figure in PLAN.figure_specs:

    rule:
        name:
            f"figure_{figure}"
        input:
            PLAN.figure_inputs(figure),
        output:
            pdf=report(
                f"results/figures/{figure}.pdf",
                caption="../report/figure.rst",
                category="Figures",
                labels={"figure": PLAN.figure_label(figure)},
            ),
            png=f"results/figures/{figure}.png",
        log:
            f"results/logs/figures/{figure}.log",
        params:
            name=figure,
            spec=PLAN.figure_spec(figure),
            holdings=PLAN.figure_holdings(figure),
            code=PLAN.figure_code(figure),
        message:
            f"Figure {figure}"
        script:
            "../scripts/figure.py"
