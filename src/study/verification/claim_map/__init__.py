"""The claim map: what each claim, figure, table and number of the text is made by, and takes.

`entries` lists what the study declares, `measured` adds what a run measured and writes
results/claim_map.csv.
"""
