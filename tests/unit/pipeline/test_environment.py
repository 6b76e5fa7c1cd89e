"""Variables that change results are cleared, those of this project are set, the rest is left."""

from pdrom.pipeline.environment import settled

INHERITED = {
    "OPENBLAS_CORETYPE": "Prescott",
    "MKL_CBWR": "AVX2",
    "NPY_DISABLE_CPU_FEATURES": "AVX2",
    "NUMBA_DISABLE_JIT": "1",
    "OMP_NUM_THREADS": "7",
    "KMP_AFFINITY": "none",
    "SOURCE_DATE_EPOCH": "1",
    "PYTHONOPTIMIZE": "2",
    "MATPLOTLIBRC": "/etc/rc",
    "TEXINPUTS": "/etc/tex",
    "LC_ALL": "tr_TR.UTF-8",
    "PATH": "/bin",
    "HOME": "/home/somebody",
    "NUMBA_CACHE_DIR": "/cache",
    "SLURM_JOB_ID": "3",
}


def test_nothing_inherited_changes_a_result():
    names = ("PATH", "HOME", "NUMBA_CACHE_DIR", "SLURM_JOB_ID")
    bare = {name: INHERITED[name] for name in names}
    assert settled(INHERITED, "Haswell") == settled(bare, "Haswell")
    assert settled(INHERITED, None) == settled(bare, None)
    assert bare.items() <= settled(INHERITED, None).items()


def test_threads_locale_and_kernels_are_fixed():
    made = settled(INHERITED, "Haswell")
    assert made["OMP_NUM_THREADS"] == made["OPENBLAS_NUM_THREADS"] == "1"
    assert made["LC_ALL"] == "C.UTF-8"
    assert made["OPENBLAS_CORETYPE"] == "Haswell"
    assert "OPENBLAS_CORETYPE" not in settled(INHERITED, None)


def test_what_is_asked_for_is_kept_as_it_is():
    asked = INHERITED | {"PDROM_KEEP": "OPENBLAS_CORETYPE OMP_NUM_THREADS NUMBA_CPU_NAME"}
    made = settled(asked, "Haswell")
    assert made["OPENBLAS_CORETYPE"] == "Prescott"
    assert made["OMP_NUM_THREADS"] == "7"
    assert "NUMBA_CPU_NAME" not in made
    assert "MKL_CBWR" not in made
    assert made["OPENBLAS_NUM_THREADS"] == "1"
