"""Work handed to the second thread: results, order, faults, sleep."""

import threading
import time

import numpy as np
import pytest

from pdrom.model.constraints.second_thread import _nothing, _second_thread, both


@pytest.mark.parametrize("threads", [1, 2])
def test_both_results_in_the_order_of_the_calls(threads):
    assert both(lambda: 1.0, lambda: 2.0, threads) == (1.0, 2.0)


@pytest.mark.parametrize("threads", [1, 2])
def test_where_the_work_is_done(threads):
    seen = []
    both(
        lambda: seen.append(threading.get_ident()),
        lambda: seen.append(threading.get_ident()),
        threads,
    )
    assert len(set(seen)) == threads
    assert threading.get_ident() in seen


def test_what_was_written_is_seen_over_many_rounds():
    """Each round reads what the other thread wrote in the last one."""
    left, right = np.zeros(1000), np.zeros(1000)
    for turn in range(1, 2001):
        a, b = left.copy(), right.copy()

        def first(b=b) -> float:
            left[:] = b + 1.0
            return left[0]

        def second(a=a) -> float:
            right[:] = a + 1.0
            return right[0]

        assert both(first, second, 2) == (turn, turn)
    assert (left == 2000).all()
    assert (right == 2000).all()


def test_a_thread_that_fell_asleep_is_woken():
    thread = _second_thread()
    for _ in range(5):
        both(float, float, 2)
        limit = time.monotonic() + 30.0
        while not thread._asleep:
            assert time.monotonic() < limit
            time.sleep(0.001)
        assert both(lambda: 3.0, lambda: 4.0, 2) == (3.0, 4.0)


def _raise(message: str) -> float:
    raise ValueError(message)


def test_faults_of_either_are_raised_and_the_next_work_is_done():
    with pytest.raises(ValueError, match="second"):
        both(float, lambda: _raise("second"), 2)
    with pytest.raises(ValueError, match="first"):
        both(lambda: _raise("first"), float, 2)
    with pytest.raises(ValueError, match="first"):
        both(lambda: _raise("first"), lambda: _raise("second"), 2)
    assert both(lambda: 1.0, lambda: 2.0, 2) == (1.0, 2.0)


def test_nothing_of_the_work_is_kept():
    """A scene's arrays go when the scene goes."""
    both(float, float, 2)
    assert _second_thread()._work is _nothing


def test_callers_in_several_threads_take_turns():
    results = []

    def call(n: float) -> None:
        results.extend(both(lambda: n, lambda: n, 2) for _ in range(200))

    callers = [threading.Thread(target=call, args=(float(n),)) for n in range(4)]
    for caller in callers:
        caller.start()
    for caller in callers:
        caller.join(timeout=60)
    assert len(results) == 800
    assert all(a == b for a, b in results)
