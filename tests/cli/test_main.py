"""The start of the command line."""

import sys

import pytest

from motorcade.__main__ import main


class Interrupt:
    """A finder of modules at which Ctrl-C arrives while the command line is imported."""

    def find_spec(self, name, path, target=None):
        if name == "motorcade.cli":
            raise KeyboardInterrupt


def test_ctrl_c_during_the_imports_ends_without_a_traceback(monkeypatch, capsys):
    for name in [name for name in sys.modules if name.startswith("motorcade.cli")]:
        monkeypatch.delitem(sys.modules, name)
    monkeypatch.setattr(sys, "meta_path", [Interrupt(), *sys.meta_path])
    with pytest.raises(SystemExit) as ended:
        main()
    assert ended.value.code == 130
    assert capsys.readouterr().err == ""
