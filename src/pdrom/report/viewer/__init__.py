"""A page on which runs are looked at: one file, drawn by the renderer of `pdrom.report.live`."""
