"""Timers of the scheduler end with the run; other threads go on."""

import threading

from pdrom.pipeline.scheduler import cancel_timers


def test_timers_are_cancelled_and_other_threads_left_alone():
    fired, go_on = [], threading.Event()
    timers = [threading.Timer(60.0, lambda: fired.append(True)) for _ in range(3)]
    other = threading.Thread(target=go_on.wait, args=(60.0,))
    for thread in (*timers, other):
        thread.start()
    cancel_timers()
    for timer in timers:
        timer.join(timeout=10.0)
        assert not timer.is_alive()
    assert not fired
    assert other.is_alive()
    go_on.set()
    other.join(timeout=10.0)
