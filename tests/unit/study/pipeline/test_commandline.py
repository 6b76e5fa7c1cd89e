"""Command lines: the files and folders that they name, and the options for Snakemake."""

import pytest

from pdrom.core.errors import ConfigurationError
from places import ROOT
from study.paper.source import figure_numbers
from study.pipeline.commandline import (
    LINES,
    OPTIONS,
    RECORD,
    CommandLine,
    completed,
    recall,
    remember,
)
from study.pipeline.folders import Folders, folders


@pytest.fixture(autouse=True)
def project(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "config").mkdir()
    for name, text in {
        "config/default.yaml": "ranks: [3]",
        "config/tiny.yaml": "ranks: [4]",
        "my.yaml": "ranks: [3]",
        "named.yaml": "study: my-name",
        "a b.yaml": "ranks: [4]",
    }.items():
        (tmp_path / name).write_text(text + "\n")
    (tmp_path / "paper").symlink_to(ROOT / "paper")


def parse(text: str) -> CommandLine:
    return CommandLine(text.split())


@pytest.mark.parametrize(
    ("arguments", "configfiles", "settings", "targets"),
    [
        ("", (), (), ()),
        ("--configfile a.yaml b.yaml -n x", ("a.yaml", "b.yaml"), (), ("x",)),
        ("--configfile=a.yaml results/x", ("a.yaml",), (), ("results/x",)),
        ("--config ranks=[3] --configfile a.yaml -- y x", ("a.yaml",), ("ranks=[3]",), ("y", "x")),
        ("-j2 -n x", (), (), ("x",)),
    ],
)
def test_a_command_line_has_files_settings_and_targets(arguments, configfiles, settings, targets):
    command = parse(arguments)
    assert (command.configfiles, command.settings) == (configfiles, settings)
    assert command.targets == targets


LOOKS_ONLY = ["-n", "-nq", "--delete-all-output -n", "--lint", "--list-rules", "--rulegraph"]
LOOKS_ONLY += ["--summary", "--report", "--report a.html"]
RUNS = ["", "--touch", "--unlock", "--delete-all-output", "--report a.html --report-after-run"]


@pytest.mark.parametrize("arguments", [*LOOKS_ONLY, *RUNS])
def test_commands_that_run_no_job_are_recognised(arguments):
    assert parse(arguments).looks_only == (arguments in LOOKS_ONLY)


@pytest.mark.parametrize(
    ("arguments", "parts"),
    [
        ("--cores x", ["--cores x", "integer or 'all'"]),
        ("--config x=1", ["--config x=1", "identifier"]),
        ("--nonsense", ["--nonsense"]),
        ("--profile rubbish", ["profile", "rubbish"]),
        ("-n --config ranks=[6] x y", ["'x'", "name=value", "--"]),
    ],
)
def test_a_wrong_option_is_named_with_its_value(arguments, parts):
    with pytest.raises(ConfigurationError) as caught:
        parse(arguments)
    assert "\n" not in str(caught.value)
    assert [part for part in parts if part not in str(caught.value)] == [], str(caught.value)


@pytest.mark.parametrize(
    ("given", "more", "made", "expected"),
    [
        (
            "--configfile a.yaml -n -- b a", "-q", {"a": ["x"], "b": ["y", "z"]},
            "--configfile a.yaml -n -q -- y z x",
        ),
        ("-n", "", {}, "-n"),
        ("x --forcerun x", "", {"x": ["a"]}, "--forcerun x -- a"),
        ("x -n", "--cores 2", {"x": ["x"]}, "-n --cores 2 -- x"),
    ],
)  # fmt: skip
def test_targets_are_replaced_and_options_kept(given, more, made, expected):
    assert parse(given).rewritten(more.split(), made) == expected.split()


@pytest.mark.parametrize(
    ("files", "settings", "name"),
    [
        ((), (), None),
        (("./config/../config/default.yaml",), (), None),
        (("config/tiny.yaml",), (), "tiny"),
        (("config/tiny.yaml", "config/default.yaml"), (), "tiny"),
        (("config/tiny.yaml",), ("ranks=[5]",), "tiny"),
        ((), ("ranks=[5]",), "own"),
        (("named.yaml", "config/tiny.yaml"), (), "my-name"),
        (("named.yaml",), ("study=other",), "other"),
        (("a b.yaml",), ("study=ab",), "ab"),
    ],
)
def test_a_configuration_has_its_folder_of_results(files, settings, name):
    results = f"results/studies/{name}"
    expected = Folders(results, f"{results}/paper/main.pdf") if name else Folders()
    assert folders(files, settings) == expected


@pytest.mark.parametrize("name", ["a b", "../x", "", "a/b", "a" * 61])
def test_a_name_that_is_no_folder_is_refused(name):
    for files, settings in (((), (f"study={name}",)), (("a b.yaml",), ())):
        with pytest.raises(ConfigurationError, match=r"study = '.*': cannot name a .* 60 let"):
            folders(files, settings)


def test_options_are_added_and_cores_unless_given():
    assert completed(["-n"]) == ["-n", "--cores", "all", *LINES, *OPTIONS]
    # Snakemake's output is shown if it is requested
    for option in ("--summary", "--verbose", "-p", "--quiet"):
        assert completed(["-n", option]) == ["-n", option, "--cores", "all", *OPTIONS]
    assert completed(["-j2"]) == ["-j2", *LINES, *OPTIONS]
    assert completed(["--cores", "1"]) == ["--cores", "1", *LINES, *OPTIONS]


def test_names_become_files_which_are_printed(capsys):
    made = ["results/figures/scaling.pdf", "results/tables/scaling.csv"]
    assert completed(["-n", "--", "scaling", "x"])[-4:] == ["--", *made, "x"]
    assert capsys.readouterr().err == f"reproduce: scaling: {', '.join(made)}\n"


@pytest.mark.parametrize(("name", "preprint"), [("reconstruction_error", 8), ("deim_entries", 3)])
def test_a_figure_has_two_numbers_and_a_name(name, preprint):
    path = f"results/figures/{name}.pdf"
    for word in (figure_numbers(ROOT)[name], f"preprint:{preprint}", name):
        given = completed(["--cores", word, "figure", word]) if word.isdigit() else ["--", path]
        assert completed(["figure", word, "-n"])[-2:] == given[-2:] == ["--", path]


@pytest.mark.parametrize(
    "asked",
    ["figure teaser -n --configfile my.yaml", "--configfile=my.yaml -n -- figure teaser"],
)
def test_a_figure_may_be_named_before_and_after_options(asked):
    command = CommandLine(completed(asked.split()))
    assert (command.configfiles, command.plans) == (("my.yaml",), True)
    assert command.targets == ("results/studies/my/figures/teaser.pdf",)


@pytest.mark.parametrize(
    ("asked", "parts"),
    [
        ("figure", ["figure ''", "allowed: 1, ", "preprint:1", "ladder"]),
        ("figure 99", ["figure '99'", "allowed: 1, "]),
        ("figure strain_run", ["figure 'strain_run'", "did you mean 'strain_runs'"]),
        # a faulty file is named before Snakemake reads the file
        ("--configfile none.yaml", ["none.yaml"]),
        ("--configfile config", ["config: a folder"]),
    ],
)
def test_a_missing_figure_or_file_is_named_with_the_existing_ones(asked, parts):
    with pytest.raises(ConfigurationError) as caught:
        completed(asked.split())
    assert [part for part in parts if part not in str(caught.value)] == [], str(caught.value)


def test_the_configuration_of_the_last_run_is_kept():
    assert recall() == []
    last = ["--configfile", "my.yaml", "--config", "a1=b", "c1=d"]
    RECORD.parent.mkdir()
    remember(CommandLine(last))
    assert recall() == last
