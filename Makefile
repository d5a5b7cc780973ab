# The two commands that matter: `make run` and `make test`. Everything lives in .venv.
PYTHON ?= python3
BIN := $(if $(filter Windows_NT,$(OS)),.venv/Scripts,.venv/bin)
STAMP := .venv/.installed

.PHONY: setup run test lint types check format lock generate bench soak clean

setup: $(STAMP)

$(STAMP): requirements.lock pyproject.toml
	$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11) and "Motorcade needs Python 3.11 or newer; this is " + sys.version.split()[0])'
	$(PYTHON) -m venv .venv
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --require-hashes --requirement requirements.lock
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --no-deps --no-build-isolation --editable .
	$(BIN)/python -c 'import pathlib; pathlib.Path("$(STAMP)").touch()'

clean:
	$(PYTHON) -c 'import shutil; shutil.rmtree(".venv", ignore_errors=True); shutil.rmtree("build", ignore_errors=True)'
