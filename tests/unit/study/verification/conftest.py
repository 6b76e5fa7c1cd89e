"""The tracked tables of the tiny study as a folder of results that agrees with its references."""

import shutil
from graphlib import TopologicalSorter
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from pdrom.core.store import read_table, write_hdf5, write_table, write_text
from places import ROOT
from study.artifact.paths import TABLE
from study.artifact.reads import TableOf
from study.tables import declared
from study.verification.compare import folder_of, read_references, write_reference
from study.verification.examine import Examination
from study.verification.subject import Subject, is_derived

RESULTS = "results/studies/tiny"


@pytest.fixture(scope="session")
def subject():
    """The tiny study, planned once, where its configuration lies."""
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(ROOT)
        subject = Subject.of(["config/tiny.yaml"], [])
        assert subject.plan.made
    return subject


@pytest.fixture(scope="session")
def tracked():
    """Tracked expected tables of the tiny study; a new table may have none yet."""
    read = read_references(ROOT / folder_of(RESULTS))
    return {name: reference.frame for name, reference in read.items()}


def timed(table, frame):
    """A table with numbers instead of times, which references do not contain."""
    rows = np.arange(len(frame))
    columns = [c.name for c in table.columns if c.timed and c.kind == "number"]
    return frame.assign(**{name: 0.5 + (7 * rows + i) % 11 for i, name in enumerate(columns)})


@pytest.fixture(scope="session")
def project(tracked, subject, tmp_path_factory):
    """A project whose results are the expected ones, with every file that figures read."""
    folder = tmp_path_factory.mktemp("project")
    for name in ("config", "paper", "src"):
        (folder / name).symlink_to(ROOT / name)
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(folder)
        patch.setattr("os.fsync", lambda descriptor: None)
        for name, table in declared().items():
            frame = tracked.get(name, table.checked(pd.DataFrame()))
            write_table(timed(table, frame), TABLE.at(RESULTS, name=name))
        for name in derived_tables():
            job = subject.plan.job(declared()[name])
            job.make(job.outputs)
        for name, table in declared().items():
            frame = table.checked(read_table(TABLE.at(RESULTS, name=name)))
            write_reference(table, frame, folder_of(RESULTS))
        figures = subject.plan.fixed["figures"]
        read = {path for job in figures for path in job.files if path.startswith("results/")}
        read |= {path for job in figures for path in job.outputs.values()}
        for path in (path for path in read if not Path(path).exists()):
            if path.endswith(".h5"):
                with write_hdf5(path):
                    pass
            else:
                write_text("there\n", path)
    return folder


def derived_tables():
    """Tables that are made from other tables, inputs first."""
    reads = {name: table.reads.values() for name, table in declared().items()}
    graph = {name: [r.name for r in own if isinstance(r, TableOf)] for name, own in reads.items()}
    return filter(is_derived, TopologicalSorter(graph).static_order())


@pytest.fixture
def results(project, monkeypatch):
    """The project as the current folder; its tables are as they were when the test ends."""
    monkeypatch.chdir(project)
    monkeypatch.setattr("os.fsync", lambda descriptor: None)
    monkeypatch.setattr("study.verification.examine.faults", lambda plan: {})
    kept = project.with_name("kept")
    shutil.copytree(project / RESULTS, kept)
    yield project
    shutil.rmtree(project / RESULTS)
    kept.rename(project / RESULTS)


@pytest.fixture(scope="session")
def expected(project, subject):
    """Expected tables by name, with all their columns, and statements about each other."""
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(project)
        examination = Examination(subject)
        return examination.expected, examination.context


@pytest.fixture
def examination(results, subject, expected):
    """An examination of the results at the time of each question."""
    found = Examination(subject)
    found.expected, found.context = expected
    return found
