"""The command line ``pdrom``."""
