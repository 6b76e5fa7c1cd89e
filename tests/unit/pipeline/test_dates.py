"""Dates in the future: moved to now, in their order, and nothing else."""

import os
import time

from pdrom.pipeline.dates import settle_dates

DAY = 86_400 * 10**9


def test_future_dates_come_before_now_in_their_order(tmp_path):
    start = time.time_ns()
    offsets = {"old": -DAY, "late": 3 * DAY, "early": DAY, "twin": DAY, "deep/later": 4 * DAY}
    for name, offset in offsets.items():
        path = tmp_path / name
        path.parent.mkdir(exist_ok=True)
        path.write_text(name)
        os.utime(path, ns=(start, start + offset))
    assert settle_dates([tmp_path, tmp_path / "none"]) == 4
    dates = {name: (tmp_path / name).stat().st_mtime_ns for name in offsets}
    assert dates["old"] == start - DAY
    assert dates["old"] < dates["early"] == dates["twin"] < dates["late"] < dates["deep/later"]
    assert dates["deep/later"] <= time.time_ns()
    assert settle_dates([tmp_path]) == 0
