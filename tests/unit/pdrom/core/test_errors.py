"""A message is one line."""

from pdrom.core.errors import ConfigurationError


def test_names_with_line_breaks_and_signals_of_terminals_are_escaped() -> None:
    error = ConfigurationError("scene 'a\nb\x1b[2J\u2028ä': no such scene")
    assert str(error) == r"scene 'a\nb\x1b[2J\u2028ä': no such scene"
