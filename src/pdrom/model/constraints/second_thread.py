"""A second thread that is handed work within microseconds.

Waking a sleeping thread takes the operating system about as long as a small local step. The thread
here looks at a number in memory for some milliseconds before it goes to sleep, so that it is awake
during the global step between two local ones; a core is busy for it, which is what two threads
means.
"""

import os
import threading
import time
from collections.abc import Callable
from functools import cache

import numpy as np
from llvmlite import ir
from numba import types
from numba.extending import intrinsic

from pdrom.model.compiled.functions import compiled

TURNS = 1 << 24  # looks before the thread sleeps, some milliseconds
SETTLE = 1 << 15  # looks after it has seen work: some microseconds, see `_await`
YIELD = 1 << 16  # looks of the caller at the end before it lets others run, where cores are few
LINE = 8  # int64 numbers of a cache line, so that the two counters do not share one

_sched_yield = types.ExternalFunction("sched_yield", types.int32())

Work = Callable[[], float]


def both(first: Work, second: Work, threads: int) -> tuple[float, float]:
    """Results of ``first`` and ``second``: in turn, or at once if ``threads`` is 2.

    What either raises is raised here. With two threads neither may write what the other reads.
    """
    if threads == 1:
        return first(), second()
    return _second_thread().beside(first, second)


def _second_thread() -> "_SecondThread":
    """The one of this process; a fork leaves it behind."""
    return _made_for(os.getpid())


@cache
def _made_for(_process: int) -> "_SecondThread":
    return _SecondThread()


def _nothing() -> float:
    """No work."""
    return 0.0


class _SecondThread:
    """One daemon thread, one piece of work at a time."""

    def __init__(self) -> None:
        # numbers of the last piece of work: given to the thread, and done by it
        self._counters = np.zeros(3 * LINE, np.int64)
        address = self._counters.ctypes.data
        self._given, self._done = address, address + LINE * self._counters.itemsize
        self._count = 0
        self._work: Work = _nothing
        self._result: float | BaseException = 0.0
        self._asleep = False
        self._wake = threading.Event()
        self._one_caller = threading.Lock()
        threading.Thread(target=self._run, name="local step", daemon=True).start()

    def beside(self, first: Work, second: Work) -> tuple[float, float]:
        """Do ``second`` in the thread and ``first`` here."""
        with self._one_caller:
            self._count += 1
            self._work = second
            publish(self._given, self._count)
            if self._asleep:
                self._wake.set()
            try:
                own = first()
            finally:
                # the caller's arrays may go away once this returns
                while not _reaches(self._done, self._count, YIELD, 0):
                    time.sleep(0)
                other, self._work, self._result = self._result, _nothing, 0.0
        if isinstance(other, BaseException):
            raise other
        return own, other

    def _run(self) -> None:
        count = 0
        while True:
            count += 1
            self._await(count)
            try:
                self._result = self._work()
            except BaseException as error:  # raised in the calling thread
                self._result = error
            publish(self._done, count)

    def _await(self, count: int) -> None:
        """Return when there is work number ``count``.

        Awake, it goes on looking for as long as the caller takes to leave the interpreter: a thread
        that requests the interpreter's lock while another has it is put to sleep.

        The flag is set before the last look, and the caller reads it after giving work, so that
        one of the two sees the other.
        """
        if _reaches(self._given, count, TURNS, SETTLE):
            return
        self._asleep = True
        while not _reaches(self._given, count, 1, 0):
            self._wake.wait()
            self._wake.clear()
        self._asleep = False


@intrinsic
def _load(_context, _address):
    """The int64 at an address, read again each time, with what was written before it."""

    def generate(_target, builder, _signature, arguments):
        pointer = builder.inttoptr(arguments[0], ir.IntType(64).as_pointer())
        return builder.load_atomic(pointer, "seq_cst", 8)

    return types.int64(types.intp), generate


@intrinsic
def _store(_context, _address, _value):
    """Write an int64 to an address, after everything that was written before."""

    def generate(target, builder, _signature, arguments):
        pointer = builder.inttoptr(arguments[0], ir.IntType(64).as_pointer())
        builder.store_atomic(arguments[1], pointer, "seq_cst", 8)
        return target.get_dummy_value()

    return types.void(types.intp, types.int64), generate


@compiled(nogil=True)
def _reaches(address, value, turns, more):
    """Whether the number at ``address`` is at least ``value`` within so many looks.

    It looks as often as ``more`` says after that.
    """
    looks = 0
    while looks < turns and _load(address) < value:
        looks += 1
    for _ in range(more):
        _load(address)
    return looks < turns


@compiled(nogil=True)
def publish(address, value):
    """Write the number ``value`` at ``address``, after everything that was written before."""
    _store(address, value)


@compiled(nogil=True)
def wait_for(address, value):
    """Return when the number at ``address`` is at least ``value``."""
    looks = 0
    while _load(address) < value:
        looks += 1
        if looks > YIELD:
            _sched_yield()
