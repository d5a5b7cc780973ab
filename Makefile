# The two commands that matter: `make run` and `make test`. While you work: `make quick`. All that they install lives in .venv.
PYTHON ?= python3
BIN := $(if $(filter Windows_NT,$(OS)),.venv/Scripts,.venv/bin)
PIP := $(BIN)/python -m pip --disable-pip-version-check --quiet
# What users need, what developers need besides, and what `make soak` and `make bench` alone need.
USERS := .venv/.installed
DEVELOPERS := .venv/.developer
MORE := .venv/.more
# Without the packages that tests never import.
COMPILE = $(BIN)/python -m compileall -qq -j 0 -x '/(babel|dask|fontTools|mypy|mypyc|numba|pip|setuptools)/' .venv src
INSTALL = $(PIP) install --no-compile --no-deps --require-hashes --requirement
EDITABLE = $(PIP) install --no-deps --no-build-isolation --editable .
TOUCH = $(BIN)/python -c 'import pathlib; [pathlib.Path(name).touch() for name in "$(1)".split()]'

.PHONY: setup run demo page wheel site quick test soak lint types format generate stale docs bench screenshots stages first-missions lock clean

run: $(USERS) ## the studio, in the browser
	$(BIN)/motorcade studio

demo: $(USERS) ## everything without a browser: compile, upload, verify, drive, draw
	$(BIN)/python examples/first_run.py

setup: $(DEVELOPERS)

# `make test` of a clean clone installs all at once: $(DEVELOPERS) ends what $(USERS) begins.
$(DEVELOPERS): DEVELOPING := yes

$(USERS): requirements.lock pyproject.toml
	$(PYTHON) -c 'import sys; sys.exit("Motorcade needs Python 3.11 or newer; this is " + sys.version.split()[0] if sys.version_info < (3, 11) else 0)'
	@echo "Motorcade is being installed into .venv: about a minute, the first time only."
	$(PYTHON) -m venv .venv
	$(INSTALL) requirements.lock
	$(if $(DEVELOPING),,$(EDITABLE))
	@# What built the page takes much room; developers keep it.
	$(if $(DEVELOPING)$(wildcard $(DEVELOPERS)),,$(BIN)/python -c 'import shutil; shutil.rmtree("web/node_modules", ignore_errors=True)')
	$(if $(DEVELOPING),,$(call TOUCH,$(USERS)))

$(DEVELOPERS): requirements-dev.lock $(USERS)
	@# Each uses one processor; Node came with what users need.
	$(INSTALL) requirements-dev.lock & $(BIN)/python hatch_build.py install && $(BIN)/python hatch_build.py build && wait $$!
	$(EDITABLE)
	$(COMPILE)
	$(call TOUCH,$(USERS) $(DEVELOPERS))

# A fuzzer, and the peers that are measured.
$(MORE): requirements-more.lock $(DEVELOPERS)
	$(INSTALL) requirements-more.lock
	$(BIN)/python -c 'import pathlib; pathlib.Path("$(MORE)").touch()'

page: $(USERS) ## build the studio's page
	$(BIN)/python hatch_build.py build

wheel: page ## the package with its page, into dist; other computers install it without Node
	$(PIP) wheel --no-deps --no-build-isolation --wheel-dir dist .

site: page ## the studio as static files, into build/studio
	$(BIN)/motorcade site -o build/studio

# A test that hangs ends its process, and the run: another process would only begin the same test.
PARALLEL := --numprocesses auto --dist loadfile --no-loadscope-reorder --max-worker-restart 0

# Which tests are quick: they need no browser, chip or network.
QUICK := tests/words tests/car tests/program tests/config tests/test_architecture.py tests/test_locales.py \
	tests/drive/test_wire.py tests/drive/test_deadman.py tests/drive/test_stamps.py

quick: setup ## lint, types, and the tests of words, cars, programs and driving that need nothing else: in 45 s
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	@# mypy uses one processor.
	$(BIN)/mypy & $(BIN)/python -m pytest --hypothesis-profile few --numprocesses logical --dist loadfile $(QUICK) && wait $$!

test: setup
	@# Debian's packages are fetched, and the tests compiled, while the page's own tests run. Tests that need packages wait.
	$(BIN)/python -m scripts.debian & $(BIN)/python -m pytest --collect-only > /dev/null & $(BIN)/python hatch_build.py test
	$(BIN)/python -m pytest $(PARALLEL)

soak: $(MORE) ## the same tests with many more examples; then bytes made by a fuzzer, and code that is changed; slow
	$(BIN)/python -m pytest --hypothesis-profile soak --override-ini faulthandler_timeout=0 $(PARALLEL)
	$(BIN)/python -m tests.fuzz --seconds 300
	$(BIN)/python -m tests.mutants
	$(BIN)/python -m tests.mutants servers --count 200

lint: setup
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/python hatch_build.py lint

types: setup
	$(BIN)/mypy
	$(BIN)/python hatch_build.py types

format: setup
	$(BIN)/ruff check --fix .
	$(BIN)/ruff format .

generate: setup
	$(BIN)/python -m scripts.generate

stale: setup
	$(BIN)/python -m scripts.generate --check

docs: setup ## the documentation's site, into build/site
	NO_MKDOCS_2_WARNING=1 $(BIN)/python -m mkdocs build

bench: $(MORE)
	$(BIN)/python benchmarks/words.py
	$(BIN)/python benchmarks/compiler.py
	$(BIN)/python benchmarks/start.py
	$(BIN)/python benchmarks/first_start.py
	$(BIN)/python benchmarks/swarm.py
	$(BIN)/python benchmarks/backends.py
	$(BIN)/python benchmarks/environments.py
	$(BIN)/python benchmarks/theory_pictures.py
	$(BIN)/python benchmarks/relay.py --crowd
	$(BIN)/python benchmarks/room.py
	$(BIN)/python benchmarks/studio_server.py
	$(BIN)/python benchmarks/class.py
	$(BIN)/python benchmarks/studio_page.py
	$(BIN)/python benchmarks/site.py
	$(BIN)/python benchmarks/drive.py
	$(BIN)/python benchmarks/avr.py
	$(BIN)/python benchmarks/chips.py

screenshots: setup ## the README's pictures of the studio, and those of the documentation
	$(BIN)/python -m scripts.screenshots
	$(BIN)/python -m scripts.page_pictures

stages: setup ## looks at the stages of all missions and examples at five sizes
	$(BIN)/python -m scripts.stages

first-missions: setup ## plays the tour and the first missions by mouse and by touch, at five sizes in both languages
	$(BIN)/python -m scripts.first_missions

LOCK = $(BIN)/uv pip compile --quiet --universal --python-version 3.11 --generate-hashes --no-emit-index-url --no-header

lock: setup ## pin the newest versions that pyproject.toml allows
	$(PIP) install uv
	$(LOCK) --all-extras --group dev --group docs --upgrade pyproject.toml --output-file requirements-dev.lock
	$(LOCK) --extra studio --extra runs --group page --constraint requirements-dev.lock pyproject.toml --output-file requirements.lock
	$(LOCK) --group soak --group bench --constraint requirements-dev.lock --output-file requirements-more.lock
	$(LOCK) --group release --constraint requirements-dev.lock --output-file requirements-release.lock

clean:
	$(PYTHON) -c 'import shutil; [shutil.rmtree(name, ignore_errors=True) for name in (".venv", "build", "dist")]'
