"""Every configuration has a folder of its own."""

from pathlib import Path

import pytest

from pdrom.core.errors import ConfigurationError
from study.pipeline.folders import Folders, folders


@pytest.fixture(autouse=True)
def project(tmp_path, monkeypatch):
    """A folder with some configurations."""
    monkeypatch.chdir(tmp_path)
    Path("config").mkdir()
    for name, text in {
        "config/default.yaml": "ranks: [3]",
        "config/tiny.yaml": "ranks: [4]",
        "named.yaml": "study: my-name",
        "a b.yaml": "ranks: [4]",
    }.items():
        Path(name).write_text(text + "\n")


@pytest.mark.parametrize(
    ("files", "settings", "name"),
    [
        ((), (), None),
        (("config/default.yaml",), (), None),
        (("./config/../config/default.yaml",), (), None),
        (("config/tiny.yaml",), (), "tiny"),
        (("config/default.yaml", "config/tiny.yaml"), (), "tiny"),
        (("config/tiny.yaml", "config/default.yaml"), (), "tiny"),
        (("config/tiny.yaml",), ("ranks=[5]",), "tiny"),
        ((), ("ranks=[5]",), "own"),
        (("named.yaml",), (), "my-name"),
        (("named.yaml", "config/tiny.yaml"), (), "my-name"),
        (("named.yaml",), ("study=other",), "other"),
        (("a b.yaml",), ("study=ab",), "ab"),
    ],
)
def test_the_folder_of_a_configuration(files, settings, name):
    results = f"results/studies/{name}"
    expected = Folders(results, f"{results}/paper/main.pdf") if name else Folders()
    assert folders(files, settings) == expected


@pytest.mark.parametrize("name", ["a b", "../x", "", "a/b", "a" * 61])
def test_a_name_that_is_no_folder_is_refused(name):
    with pytest.raises(ConfigurationError, match=r"study = '.*': no name of a folder.* 60 at most"):
        folders((), (f"study={name}",))


def test_a_file_whose_name_is_no_folder_needs_the_key():
    with pytest.raises(ConfigurationError, match="set the key study"):
        folders(("a b.yaml",), ())
