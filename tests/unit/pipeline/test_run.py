"""What a run says at its beginning."""

from pdrom.pipeline.run import say_compilation


def test_kernels_are_compiled_once(tmp_path, capsys):
    say_compilation(str(tmp_path))
    assert capsys.readouterr().err == "pdrom: the first jobs compile kernels (once, some minutes)\n"
    (tmp_path / "dynamics_1").mkdir()
    (tmp_path / "dynamics_1" / "loop.iterate_0-1.py312.nbi").touch()
    say_compilation(str(tmp_path))
    assert capsys.readouterr().err == ""
