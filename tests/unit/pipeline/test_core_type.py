"""The kernels that are pinned run on the machine, and are those that it then uses."""

import json
import os
import subprocess
import sys

import pytest

from pdrom.pipeline.core_type import core_type, core_type_here, processor_features

# as Linux prints them: a Haswell, a virtual machine that hides AVX2, and an ARM processor
CPUINFO = {
    "Haswell": "processor\t: 0\nflags\t\t: fpu sse4_2 avx f16c fma avx2 bmi2\n",
    "Nehalem": "processor\t: 0\nflags\t\t: fpu sse4_2 avx fma\n",
    "mixed": "flags\t\t: sse4_2 fma avx2\n\nflags\t\t: sse4_2 fma\n",
    "arm": "processor\t: 0\nFeatures\t: fp asimd evtstrm aes\n",
    "empty": "",
}


@pytest.mark.parametrize(
    ("system", "machine", "cpuinfo", "expected"),
    [
        ("Linux", "x86_64", "Haswell", "Haswell"),
        ("Linux", "x86_64", "Nehalem", "Nehalem"),
        ("Linux", "x86_64", "mixed", "Nehalem"),
        ("Linux", "x86_64", "empty", "Nehalem"),
        ("Linux", "aarch64", "arm", "ARMV8"),
        ("Linux", "riscv64", "empty", None),
        ("Darwin", "arm64", "empty", None),
        ("Darwin", "x86_64", "empty", None),
    ],
)
def test_kernels_are_the_newest_that_every_processor_has(system, machine, cpuinfo, expected):
    assert core_type(system, machine, processor_features(CPUINFO[cpuinfo])) == expected


def test_the_kernels_are_those_of_numpy_and_of_scipy():
    """Set as a run sets them, both libraries report them."""
    kernels = core_type_here()
    if not kernels:
        pytest.skip("nothing to choose on this machine")
    code = (
        "import json; from pdrom.core.machine import loaded_kernels as k;"
        "print(json.dumps([[x.architecture, x.library] for x in k() if x.kind == 'blas']))"
    )
    environment = {**os.environ, "OPENBLAS_CORETYPE": kernels}
    done = subprocess.run(
        [sys.executable, "-c", code], env=environment, capture_output=True, text=True, check=True
    )
    found = json.loads(done.stdout)
    assert [name.lower() for name, _ in found] == [kernels.lower()] * 2
    assert {library for _, library in found} == {"openblas"}
