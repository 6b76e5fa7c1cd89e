"""YAML files: plain, without repeated keys; errors name the file, the key and the value."""

import pytest
from pydantic import Field

from pdrom.core.errors import ConfigurationError
from pdrom.core.yamlfile import (
    MAX_BYTES,
    MAX_NAME,
    MAX_PATH,
    ConfigModel,
    check_lengths,
    read_yaml,
    validate,
)  # fmt: skip
from study.pipeline.commandline import CommandLine


class Inner(ConfigModel):
    size: int
    kind: str = "a"


class Outer(ConfigModel):
    name: str
    inner: Inner
    many: dict[str, Inner] = Field(default_factory=dict)
    row: tuple[Inner, ...] = ()
    other: str = Field(default="x", alias="another")


def test_a_name_without_its_ending_is_suggested_with_it(tmp_path):
    (tmp_path / "flag.yaml").write_text("a: 1")
    with pytest.raises(ConfigurationError, match=r"flag: no such .*did you mean '.*flag\.yaml'\?"):
        read_yaml(tmp_path / "flag")
    with pytest.raises(ConfigurationError, match=r"gone\.yaml: no such configuration file$"):
        read_yaml(tmp_path / "gone.yaml")


GOOD = {"name": "n", "inner": {"size": 1}}


def written(tmp_path, content: str | bytes):
    path = tmp_path / "file.yaml"
    path.write_bytes(content.encode() if isinstance(content, str) else content)
    return path


def test_plain_yaml_is_read(tmp_path):
    path = written(tmp_path, "a: 1\nb: [1.5, x, null]\nc: {d: true}\n")
    assert read_yaml(path) == {"a": 1, "b": [1.5, "x", None], "c": {"d": True}}
    # a byte order mark does not belong to the text
    assert read_yaml(written(tmp_path, b"\xef\xbb\xbfa: 1\n")) == {"a": 1}


@pytest.mark.parametrize(
    ("content", "message"),
    [
        ("a: &x [1]\nb: *x\n", r"alias '\*x' is not allowed"),
        ("a: 1\nb: 2\na: 3\n", "key 'a' is given twice"),
        ("- {b: {a: 1, a: 1}}\n", "key 'a' is given twice"),
        ("[1, 2]: 3\n", "not valid YAML"),
        (b"a: \xff\xfe\n", "not valid YAML"),
        ("a: " + "9" * 5000, "not valid YAML.*limit"),
        ("[" * 3000, "not valid YAML"),
        ("#" * (MAX_BYTES + 1), "larger than"),
    ],
)
def test_faulty_files_are_named_in_one_line(tmp_path, content, message):
    with pytest.raises(ConfigurationError, match=rf"file\.yaml: .*{message}") as caught:
        read_yaml(written(tmp_path, content))
    assert "\n" not in str(caught.value)


ODD = "20:0 1_0 06 010 08 0x1F 0b11 -1_0.5 .5_0 1e0_5 1:30.5 !!int~'010' {b:~[7,~06]} {1_0:~1}"


@pytest.mark.parametrize("value", [value.replace("~", " ") for value in ODD.split()])
def test_a_number_that_yaml_would_change_is_named_as_written(tmp_path, value):
    words = r"file\.yaml: aa(\.b\.1)? = [^ ]*[\d_F]+: YAML reads it as .*; write a decimal number"
    with pytest.raises(ConfigurationError, match=words):
        read_yaml(written(tmp_path, f"aa: {value}\n"))
    command = ["--config", f"aa={value}"]
    with pytest.raises(ConfigurationError, match=words.replace(r"file\.yaml", "--config")):
        CommandLine(command)


class Typed(ConfigModel):
    number: float = 0.0
    text: str = ""
    truth: bool = False


@pytest.mark.parametrize(
    ("key", "value", "expected"),
    [
        *(("number", text, float(text)) for text in ("1e5", "-1.0e5", ".5", "5.", "+0", "00.5")),
        *(("number", text, float(text.replace(".", ""))) for text in ("+.inf", "-.INF")),
        *(("text", text, text) for text in ("no", "On", "2020-01-01", "1.2.3", ".", "12:60")),
        *(("text", f"'{text}'", text) for text in ("20:0", "010", "true")),
        *(("truth", text, True) for text in ("yes", "on", "True")),
        *(("number", text, None) for text in ("yes", "off", "2020-01-01", "0o17", "'1_0'", "true")),
    ],
)
def test_words_dates_and_plain_numbers_are_read_as_written(tmp_path, key, value, expected):
    data = read_yaml(written(tmp_path, f"{key}: {value}\n"))
    if expected is not None:
        assert getattr(validate(Typed, data, "source"), key) == expected
        return
    with pytest.raises(ConfigurationError, match=f"(?i)source: number = '?{value}"):
        validate(Typed, data, "source")


@pytest.mark.parametrize("tag", ["object/apply:pathlib.Path.touch", "name:os.system", "tuple"])
def test_tags_that_run_code_are_refused(tmp_path, tag):
    with pytest.raises(ConfigurationError, match=f"could not determine a constructor.*{tag}"):
        read_yaml(written(tmp_path, f"a: !!python/{tag} ['{tmp_path / 'made'}']\n"))
    assert not (tmp_path / "made").exists()


INNER = r"\(allowed: size, kind\)"


@pytest.mark.parametrize(
    ("data", "message"),
    [
        ({**GOOD, "nam": 1}, r"unknown key 'nam' \(allowed: name, inner, many, row, another\)"),
        ({**GOOD, "inner": {"size": 1, "sise": 2}}, rf"unknown key 'inner\.sise' {INNER}"),
        ({**GOOD, "many": {"k": {"size": 1, "x": 2}}}, rf"unknown key 'many\.k\.x' {INNER}"),
        ({**GOOD, "row": [{"size": 1, "x": 2}]}, rf"unknown key 'row\.0\.x' {INNER}"),
        ({**GOOD, "name": 3}, "name = 3: .*valid string"),
        *((data, "a mapping of keys is required") for data in (None, [], "text", 3)),
    ],
)
def test_faults_name_source_key_and_allowed_values(data, message):
    with pytest.raises(ConfigurationError, match=f"^source: {message}"):
        validate(Outer, data, "source")


def test_a_file_name_is_limited_in_bytes_not_in_letters():
    check_lengths("a/" + 255 * "b")
    check_lengths("a/" * 2000)
    for path, words in ((128 * "é", f"at most {MAX_NAME} bytes"), (2048 * "a/", str(MAX_PATH))):
        with pytest.raises(ValueError, match=words):
            check_lengths(path)
