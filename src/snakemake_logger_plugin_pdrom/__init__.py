"""Snakemake finds ``--logger pdrom`` by the name of this package."""

from snakemake_interface_logger_plugins.base import LogHandlerBase

from study.pipeline.progress import Progress


class LogHandler(Progress, LogHandlerBase):
    """One line a job on standard error; Snakemake's own account stays in its log."""

    writes_to_stream = True
    writes_to_file = False
    has_filter = False
    has_formatter = True
    needs_rulegraph = False

    def __post_init__(self) -> None:
        self.start(self.common_settings.dryrun)
