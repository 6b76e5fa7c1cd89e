"""Command lines, the configuration files that they name, and the last of them."""

import pytest

from pdrom.core.errors import ConfigurationError
from study.pipeline.commandline import CommandLine, check_files


def parse(text: str) -> CommandLine:
    return CommandLine.parse(text.split())


@pytest.mark.parametrize(
    ("arguments", "configfiles", "settings", "targets"),
    [
        ("", (), (), ()),
        ("--configfile a.yaml", ("a.yaml",), (), ()),
        ("--configfile a.yaml b.yaml -n x", ("a.yaml", "b.yaml"), (), ("x",)),
        ("--configfiles a.yaml --cores 2", ("a.yaml",), (), ()),
        ("--configfile=a.yaml results/x", ("a.yaml",), (), ("results/x",)),
        ("--config ranks=[3] --configfile a.yaml -- y x", ("a.yaml",), ("ranks=[3]",), ("y", "x")),
        ("-j2 -n x", (), (), ("x",)),
    ],
)
def test_files_settings_and_targets(arguments, configfiles, settings, targets):
    command = parse(arguments)
    assert (command.configfiles, command.settings) == (configfiles, settings)
    assert command.targets == targets


@pytest.mark.parametrize(
    ("arguments", "looks_only"),
    [
        ("", False),
        ("--touch", False),
        ("--unlock", False),
        ("--delete-all-output", False),
        ("--delete-all-output -n", True),
        ("-n", True),
        ("-nq", True),
        ("--lint", True),
        ("--list-rules", True),
        ("--rulegraph", True),
        ("--summary", True),
        ("--report", True),
        ("--report a.html", True),
        ("--report a.html --report-after-run", False),
    ],
)
def test_what_runs_no_job(arguments, looks_only):
    assert parse(arguments).looks_only == looks_only


@pytest.mark.parametrize(
    ("arguments", "expected"),
    [
        ("-n --config a=b results/x y", "-n --config a=b -- results/x y"),
        ("--config a=b x -- y", "--config a=b -- x y"),
        ("--configfile a.yaml x", "--configfile a.yaml -- x"),
        ("--configfile a.yaml x --cores 2", "--configfile a.yaml --cores 2 -- x"),
    ],
)
def test_a_forgotten_separator_is_explained(arguments, expected):
    with pytest.raises(ConfigurationError, match="two hyphens before the targets") as caught:
        parse(arguments)
    assert str(caught.value).endswith(f": {expected}")


@pytest.mark.parametrize(
    ("given", "more", "made", "expected"),
    [
        (
            "--configfile a.yaml -n -- b a", "-q", {"a": ["x"], "b": ["y", "z"]},
            "--configfile a.yaml -n -q -- y z x",
        ),
        ("-n", "", {}, "-n"),
        ("-n --forcerun x -- x", "", {"x": ["a.pdf"]}, "-n --forcerun x -- a.pdf"),
        ("x --forcerun x", "", {"x": ["a"]}, "--forcerun x -- a"),
        ("x -n", "--cores 2", {"x": ["x"]}, "-n --cores 2 -- x"),
    ],
)  # fmt: skip
def test_targets_are_replaced_and_options_kept(given, more, made, expected):
    assert parse(given).rewritten(more.split(), made) == expected.split()


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
