"""What is refused of a configuration file."""

import pytest

from pdrom.core.errors import ConfigurationError
from pdrom.pipeline.configfiles import check_files


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
