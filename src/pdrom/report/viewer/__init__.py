"""A page on which runs are looked at: one file, no network, drawn by the renderer of `pdrom.report.live`."""
