"""The study: experiments, tables, figures, verdicts and the paper, made with pdrom.

Data flow, one direction only: runs -> tables -> figures -> paper.
"""
