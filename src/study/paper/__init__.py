"""The manuscript: TeX macros and tables from the results, bibliography, PDFs."""
