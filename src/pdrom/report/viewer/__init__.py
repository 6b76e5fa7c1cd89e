"""A page on which runs are looked at: one file, no network, drawn as `pdrom.report.live` draws."""
