"""A page on which runs are looked at: one file, no network, drawn as `study.live` draws."""
