"""Which files the command line names, and what is refused of them."""

import pytest

from pdrom.core.errors import ConfigurationError
from pdrom.pipeline.configfiles import check_files, named_files


@pytest.mark.parametrize(
    ("arguments", "files"),
    [
        ("-n", []),
        ("--configfile a.yaml", ["a.yaml"]),
        ("--configfile a.yaml b.yaml -n results/x", ["a.yaml", "b.yaml"]),
        ("--configfiles a.yaml --cores 2", ["a.yaml"]),
        ("--configfile=a.yaml results/x", ["a.yaml"]),
        ("--config ranks=[3] --configfile a.yaml -- results/x", ["a.yaml"]),
        ("--cores 2 results/x", []),
    ],
)
def test_files_named_by_options(arguments, files):
    assert named_files(arguments.split()) == files


@pytest.mark.parametrize(
    ("content", "message"),
    [
        ("", "found nothing"),
        ("[1]", r"found \[1\]"),
        ("a: 1\na: 2", "given twice"),
        ("__use_yte__: true\n", "templates are not allowed"),
    ],
)
def test_faulty_files_are_named(tmp_path, content, message):
    (tmp_path / "good.yaml").write_text("a: 1")
    (tmp_path / "bad.yaml").write_text(content)
    with pytest.raises(ConfigurationError, match=rf"bad\.yaml: .*{message}"):
        check_files([tmp_path / "good.yaml", tmp_path / "bad.yaml"])
