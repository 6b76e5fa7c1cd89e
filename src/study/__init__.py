"""Make the study with pdrom: experiments, tables, figures, verdicts and the paper.

Data flow only from runs to tables, and from tables to figures and the paper.
"""
