"""Pictures, films, tables and files of a single scene, of the pipeline's results or of own runs."""
