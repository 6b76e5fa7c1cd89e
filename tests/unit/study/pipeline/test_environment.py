"""Environment variables of the jobs, and the kernels of OpenBLAS."""

import json
import os
import platform
import subprocess
import sys

import pytest

from pdrom.core.environment import (
    COMPILED_HASWELL,
    compiled_for,
    core_type,
    features_here,
    processor_features,
    settled,
)

INHERITED = {
    "OPENBLAS_CORETYPE": "Prescott", "MKL_CBWR": "AVX2", "NPY_DISABLE_CPU_FEATURES": "AVX2",
    "NUMBA_DISABLE_JIT": "1", "NUMBA_CPU_NAME": "cascadelake", "OMP_NUM_THREADS": "7",
    "KMP_AFFINITY": "none", "SOURCE_DATE_EPOCH": "1", "PYTHONOPTIMIZE": "2",
    "MATPLOTLIBRC": "/etc/rc", "TEXINPUTS": "/etc/tex", "LC_ALL": "tr_TR.UTF-8", "PATH": "/bin",
    "HOME": "/home/somebody", "NUMBA_CACHE_DIR": "/cache", "SLURM_JOB_ID": "3",
}  # fmt: skip


def test_no_inherited_variable_changes_a_result():
    names = ("PATH", "HOME", "NUMBA_CACHE_DIR", "SLURM_JOB_ID")
    bare = {name: INHERITED[name] for name in names}
    for kernels, target in (("Haswell", compiled_for("x86_64", set(COMPILED_HASWELL))), (None, {})):
        made = settled(INHERITED, kernels, target)
        assert made == settled(bare, kernels, target)
        assert bare.items() <= made.items()
        assert made["OMP_NUM_THREADS"] == made["OPENBLAS_NUM_THREADS"] == "1"
        assert made["LC_ALL"] == "C.UTF-8"
        assert made.get("OPENBLAS_CORETYPE") == kernels


def test_requested_variables_are_kept():
    asked = INHERITED | {"PDROM_KEEP": "OPENBLAS_CORETYPE OMP_NUM_THREADS NUMBA_CPU_NAME"}
    made = settled(asked, "Haswell", compiled_for("x86_64", set(COMPILED_HASWELL)))
    assert made["OPENBLAS_CORETYPE"] == "Prescott"
    assert made["OMP_NUM_THREADS"] == "7"
    assert made["NUMBA_CPU_NAME"] == "cascadelake"
    assert "NUMBA_CPU_FEATURES" not in made
    assert "MKL_CBWR" not in made
    assert made["OPENBLAS_NUM_THREADS"] == "1"


# as Linux prints them: Haswell, a virtual machine without AVX2, ARM
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
        ("Linux", "aarch64", "arm", "ARMV8"),
        ("Linux", "riscv64", "empty", None),
        ("Darwin", "arm64", "empty", None),
    ],
)
def test_kernels_are_the_newest_that_all_processors_support(system, machine, cpuinfo, expected):
    assert core_type(system, machine, processor_features(CPUINFO[cpuinfo])) == expected


def said(code: str, environment: dict[str, str]) -> list:
    """JSON output of a program in an environment."""
    command = [sys.executable, "-c", f"import json; {code}"]
    return json.loads(subprocess.run(command, env=environment, stdout=-1, check=True).stdout)


def test_numpy_and_scipy_use_the_chosen_kernels():
    """With the variables of a run, both libraries report these kernels."""
    kernels = core_type(platform.system(), platform.machine(), features_here())
    if not kernels:
        pytest.skip("nothing to choose on this machine")
    code = (
        "from pdrom.core.machine import loaded_kernels as k;"
        "print(json.dumps([[x['architecture'], x['library']] for x in k() if x['kind'] == 'blas']))"
    )
    found = said(code, {**os.environ, "OPENBLAS_CORETYPE": kernels})
    assert [name.lower() for name, _ in found] == [kernels.lower()] * 2
    assert {library for _, library in found} == {"openblas"}


@pytest.mark.parametrize("missing", sorted(COMPILED_HASWELL))
def test_a_processor_without_a_required_instruction_keeps_the_default_target(missing):
    assert (
        compiled_for("x86_64", set(COMPILED_HASWELL) | {"avx512f"})["NUMBA_CPU_NAME"] == "haswell"
    )
    assert compiled_for("x86_64", set(COMPILED_HASWELL) - {missing}) == {}
    assert compiled_for("riscv64", set(COMPILED_HASWELL)) == {}
    assert compiled_for("aarch64", set()) == compiled_for("arm64", {"asimd"})


def test_kernels_are_compiled_for_the_chosen_processor():
    """The target that numba reports, and by which it names its cache, is the chosen one."""
    target = compiled_for(platform.machine(), features_here())
    code = (
        "from pdrom.model.compiled.dots import dot; import numpy as np;"
        "dot(np.ones(3), np.ones(3)); library = dot.overloads[dot.signatures[0]].library;"
        "print(json.dumps(library.codegen.magic_tuple()[1:]))"
    )
    # the inherited name is another processor, so that an effect of it would show
    inherited = {**os.environ, "NUMBA_CPU_NAME": "generic", "NUMBA_CPU_FEATURES": ""}
    name, features = said(code, settled(inherited, None, target))
    if target:
        assert [name, features] == list(target.values())
    else:
        assert name != "generic"
