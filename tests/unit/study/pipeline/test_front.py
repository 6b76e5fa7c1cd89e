"""What ``./reproduce ARGS...`` hands to Snakemake."""

import pytest

from pdrom.core.errors import ConfigurationError
from places import ROOT
from study.paper.figure_numbers import figure_numbers
from study.pipeline.commandline import RECORD, CommandLine, recall, remember
from study.pipeline.front import LINES, OPTIONS, completed


@pytest.fixture(autouse=True)
def project(tmp_path, monkeypatch):
    """A folder with a configuration."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "my.yaml").write_text("ranks: [3]\n")
    (tmp_path / "config").mkdir()
    (tmp_path / "config" / "figures.yaml").write_text("scaling: {}\n")
    (tmp_path / "paper").symlink_to(ROOT / "paper")


def test_options_are_added_and_cores_unless_given():
    assert completed(["-n"]) == ["-n", "--cores", "all", *LINES, *OPTIONS]
    assert completed(["-n", "--verbose"]) == ["-n", "--verbose", "--cores", "all", *OPTIONS]
    assert completed(["-n", "--summary"]) == ["-n", "--summary", "--cores", "all", *OPTIONS]
    assert completed(["-j2"]) == ["-j2", *LINES, *OPTIONS]
    assert completed(["--cores", "1"]) == ["--cores", "1", *LINES, *OPTIONS]


@pytest.mark.parametrize("option", ["--verbose", "-p", "--quiet"])
def test_who_asks_for_snakemakes_own_output_gets_it(option):
    assert "--logger" not in completed([option])


def test_names_become_files_and_it_is_said(capsys):
    made = ["results/figures/scaling.pdf", "results/tables/scaling.csv"]
    assert completed(["-n", "--", "scaling", "x"])[-4:] == ["--", *made, "x"]
    assert capsys.readouterr().err == f"reproduce: scaling: {', '.join(made)}\n"


@pytest.mark.parametrize(
    ("name", "document", "preprint"),
    [("reconstruction_error", "main.pdf", 8), ("deim_entries", "supplement.pdf", 3)],
)
@pytest.mark.parametrize("asked", ["own", "preprint", "name"])
def test_a_figure_has_two_numbers_and_a_name(name, document, preprint, asked, capsys):
    number = figure_numbers(ROOT)[name].manuscript
    word = {"own": number, "preprint": f"preprint:{preprint}", "name": name}[asked]
    made = f"results/figures/{name}.pdf"
    assert completed(["figure", word, "-n"]) == [
        "-n", "--cores", "all", *LINES, *OPTIONS, "--", made,
    ]  # fmt: skip
    numbers = f"figure {number} of {document}, figure {preprint} of the preprint"
    said = f"reproduce: figure {name} ({numbers}): {made}\n"
    assert capsys.readouterr().err == said


@pytest.mark.parametrize(
    ("asked", "message"),
    [
        ([], r"figure: its number or name is missing \(allowed: 1, .*, preprint:1, .*, ladder"),
        (["99"], r"figure 99: there is none \(allowed: 1, 2, 3,"),
        (["preprint:10"], r"figure preprint:10: there is none \(allowed: 1, 2, 3,"),
        (["strain_run"], "figure strain_run: .*did you mean 'strain_runs'"),
    ],
)
def test_an_unknown_figure_says_which_there_are(asked, message):
    with pytest.raises(ConfigurationError, match=message):
        completed(["figure", *asked])


def test_a_faulty_configuration_file_is_named_before_snakemake_reads_it():
    with pytest.raises(ConfigurationError, match=r"none\.yaml: no such configuration file"):
        completed(["--configfile", "none.yaml"])


def test_the_report_is_of_the_last_run(capsys):
    assert completed(["--report"]) == ["--report", "--cores", "all", *OPTIONS]
    remember(CommandLine.parse(["--configfile", "my.yaml", "--config", "a=b", "c=d"]))
    last = ["--configfile", "my.yaml", "--config", "a=b", "c=d"]
    assert recall() == last
    assert completed(["--report"]) == ["--report", *last, "--cores", "all", *OPTIONS]
    assert "a report of the last run, --configfile my.yaml" in capsys.readouterr().err
    own = ["--report", "--configfile", "my.yaml"]
    assert completed(own) == [*own, "--cores", "all", *OPTIONS]


@pytest.mark.parametrize("content", ["", "[]", "{}", '{"configfiles": 3, "settings": []}', "\x00"])
def test_a_damaged_record_counts_as_none(content):
    RECORD.parent.mkdir()
    RECORD.write_text(content)
    assert recall() == []
