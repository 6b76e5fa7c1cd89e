"""The manuscript: macros and tables from the results, bibliography, TeX."""
