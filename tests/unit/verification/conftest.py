"""The tracked tables of the tiny study, as what is expected and as what was found."""

import pytest
from settled_times import settled

from pdrom.pipeline.tables import all_tables
from pdrom.verification.references import read_reference
from pdrom.verification.settings import load_settings
from pdrom.verification.spread import comparisons
from pdrom.verification.subject import Subject
from pdrom.verification.tolerances import load_tolerances
from places import ROOT

REFERENCES = ROOT / "results" / "reference"


@pytest.fixture(scope="session")
def subject():
    """The tiny study, planned once, where its configuration lies."""
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(ROOT)
        subject = Subject.of(["config/tiny.yaml"], [])
        assert subject.plan.figure_jobs
    return subject


@pytest.fixture(scope="session")
def references():
    """Expected tables of the tiny study as they are kept; a new one may have none yet."""
    folder = REFERENCES / "studies" / "tiny" / "tables"
    read = {name: read_reference(table, folder) for name, table in all_tables().items()}
    return {name: reference for name, reference in read.items() if reference is not None}


@pytest.fixture(scope="session")
def expected(references):
    """The same as tables with all their columns, and with the speed-ups that tests rely on."""
    return settled({name: reference.frame for name, reference in references.items()})


@pytest.fixture(scope="session")
def unchanged(expected):
    """Every table compared with itself."""
    return comparisons(all_tables(), expected, expected)


@pytest.fixture(scope="session")
def tolerances():
    """The tracked tolerances."""
    return load_tolerances([REFERENCES / "tolerances.csv"])


@pytest.fixture(scope="session")
def settings():
    """config/verification.yaml."""
    return load_settings(ROOT)
