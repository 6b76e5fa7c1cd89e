"""The study: experiments, tables, figures, verdicts and the paper, made with pdrom.

Data flow in one direction only: from runs to tables, figures and the paper.
"""
