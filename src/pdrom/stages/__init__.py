"""One module per workflow rule: paths and plain parameters in, files out."""
