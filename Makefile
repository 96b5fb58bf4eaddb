# Needs Python 3.11 or newer, pip and make. Choose the interpreter with: make demo PYTHON=python3.12
PYTHON ?= python3
VENV   ?= .venv
PYTEST_ARGS ?= -q -n auto --dist worksteal
# Workers and the programs that tests start find the bytecode of modules, instead of each compiling all of them.
TEST_ENV := OPENBLAS_NUM_THREADS=1 PYTHONDONTWRITEBYTECODE=

BIN   := $(VENV)/bin
STAMP := $(VENV)/.installed
STAMP_MORE := $(VENV)/.installed-more
STAMP_SITE := $(VENV)/.installed-site
PIP   := $(BIN)/python -m pip --quiet --quiet --disable-pip-version-check --no-input

.DEFAULT_GOAL := help
.PHONY: help demo test test-fast test-long test-thorough test-all mutants check bench fuzz docs site validation wheel sbom lock clean

help:
	@echo "make demo        set up, then run the demonstration (stillhook demo)"
	@echo "make test        set up, then run the tests (about five minutes)"
	@echo "make test-fast   set up, then run the tests that take a minute"
	@echo "make test-long   set up, then run what make test leaves out (ten minutes)"
	@echo "make test-all    set up, then run every test, and compute all pages of the documentation again"
	@echo "make mutants     set up, then draw 100 small changes of the sources and see which the tests notice (an hour on two cores)"
	@echo "make check       set up, then ruff, import layers and mypy"
	@echo "make bench       set up, then measure speed against the references; with AGAINST=commit also against that version"
	@echo "make fuzz        set up, then fuzz every reader and parser for an hour, or as FUZZ_ARGS says; continues where it ended"
	@echo "make docs        set up, then write the generated pages and check the links"
	@echo "make site        set up, then build the documentation site in build/site/html: no network is needed to read it"
	@echo "make validation  set up, then compute the validation pages anew"
	@echo "make wheel       set up, then build a wheel with compiled kernels for Linux, Windows and macOS in dist (minutes)"
	@echo "make sbom        set up, then write dist/stillhook.cdx.json: every locked package, hashes and licences (CycloneDX)"
	@echo "make lock        write requirements.lock, that of tests/ and that of docs/ anew from pyproject.toml"
	@echo "make clean       remove the environment and everything that tools leave behind"

demo: $(STAMP)
	@$(BIN)/stillhook demo

test: $(STAMP)
	@$(TEST_ENV) $(BIN)/python -m pytest $(PYTEST_ARGS) -m "not long and not thorough"

test-fast: $(STAMP)
	@$(TEST_ENV) $(BIN)/python -m pytest $(PYTEST_ARGS) -m "not slow and not long and not thorough"

# The tests that take most of the time: continuous integration runs them after `make test`.
test-long: $(STAMP_MORE)
	@$(TEST_ENV) $(BIN)/python -m pytest $(PYTEST_ARGS) -m "long and not thorough"

# What both leave out; and what `make test` skips where tests/requirements.lock is not installed.
test-thorough: $(STAMP_MORE)
	@$(TEST_ENV) $(BIN)/python -m pytest $(PYTEST_ARGS) -m thorough

test-all: $(STAMP_MORE) test test-long test-thorough
	@$(BIN)/python docs/validation/make.py --check

# Outcomes are kept in build/mutants: a run that was stopped goes on. A second sample: make mutants MUTANTS="--seed 2 --number 40"
mutants: $(STAMP)
	@$(TEST_ENV) $(BIN)/python -m trials.mutants $(MUTANTS)

check: $(STAMP_MORE)
	@echo "ruff check" && $(BIN)/ruff check --quiet --output-format concise .
	@echo "ruff format" && $(BIN)/ruff format --quiet --check .
	@echo "import layers" && $(BIN)/lint-imports --no-logo --no-cache
	@echo "mypy" && $(BIN)/mypy --no-error-summary
	@echo "check: passed"

bench: $(STAMP_MORE)
	@$(BIN)/python -m benchmarks.run
	@$(BIN)/python -m benchmarks.winch_types
	@$(BIN)/python -m benchmarks.exports
	@$(BIN)/python -m benchmarks.session
	@test -z "$(AGAINST)" || $(BIN)/python -m benchmarks.against $(AGAINST)

# For example: make fuzz FUZZ_ARGS="--target 'sea/*' --time '8 h'"; --summary shows what was found so far.
fuzz: $(STAMP)
	@$(BIN)/python -m fuzz $(FUZZ_ARGS)

docs: $(STAMP)
	@$(BIN)/python docs/images/make.py && $(BIN)/python docs/generate.py

site: $(STAMP_SITE)
	@OPENBLAS_NUM_THREADS=1 $(BIN)/python -m sphinx --quiet --fail-on-warning --keep-going \
		--doctree-dir build/site/doctrees $(SITE_ARGS) docs build/site/html
	@echo "build/site/html/index.html: open it in a browser"

validation: $(STAMP_MORE)
	@$(BIN)/python docs/validation/make.py

wheel: $(STAMP)
	@$(BIN)/python -m hatchling build -t wheel

sbom: $(STAMP)
	@$(BIN)/python release/sbom.py dist/stillhook.cdx.json

# The set-up is done again only when the lock or pyproject.toml has changed. Bytecode is written for what is imported alone.
$(STAMP): requirements.lock pyproject.toml
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11))' || \
		{ echo "Stillhook needs Python 3.11 or newer. Choose one: make PYTHON=python3.12"; exit 1; }
	@echo "Setting up $(VENV) from requirements.lock (a few minutes the first time)"
	@test -x $(BIN)/python || $(PYTHON) -m venv $(VENV)
	@$(PIP) install --no-compile --require-hashes -r requirements.lock
	@$(PIP) install --no-deps --no-build-isolation --editable .
	@touch $@

# What checks, benchmarks and a few tests take on top, at the same versions: 390 MB that others do without.
$(STAMP_MORE): tests/requirements.lock $(STAMP)
	@$(PIP) install --no-compile --require-hashes -r tests/requirements.lock
	@touch $@

# What the site needs on top of both (a page of the gallery runs FMPy), at the same versions: 200 MB that tests do without.
$(STAMP_SITE): docs/requirements.lock $(STAMP_MORE)
	@$(PIP) install --require-hashes -r docs/requirements.lock
	@touch $@

# Needs uv. Pins stay where they are unless pyproject.toml asks for more; make lock UV_ARGS=--upgrade takes the newest of everything.
# Addresses of package indexes come from the environment only and must never reach the file.
UV ?= uv
lock:
	@cp requirements.lock lock.tmp
	@$(UV) pip compile pyproject.toml --quiet --universal --generate-hashes --python-version 3.11 \
		--extra dev --extra native --extra gas --extra report --extra stability --extra logs --extra dask --extra sea --extra live --extra learn --no-emit-index-url --no-emit-find-links --no-header $(UV_ARGS) --output-file lock.tmp
	@printf '%s\n' '# Every package that Stillhook needs, for every platform, with hashes. Written by: make lock' > requirements.lock
	@cat lock.tmp >> requirements.lock
	@touch tests/requirements.lock && cp tests/requirements.lock lock.tmp
	@$(UV) pip compile --group development --constraints requirements.lock --quiet --universal --generate-hashes --python-version 3.11 \
		--no-emit-index-url --no-emit-find-links --no-header $(UV_ARGS) --output-file lock.tmp
	@printf '%s\n' '# What checks, benchmarks and a few tests take on top of requirements.lock, with hashes. Written by: make lock' > tests/requirements.lock
	@cat lock.tmp >> tests/requirements.lock
	@cp docs/requirements.lock lock.tmp
	@$(UV) pip compile --group docs --constraints requirements.lock --quiet --universal --generate-hashes --python-version 3.11 \
		--no-emit-index-url --no-emit-find-links --no-header --no-annotate $(UV_ARGS) --output-file lock.tmp
	@printf '%s\n' '# What the documentation site needs on top of requirements.lock, with hashes. Written by: make lock' > docs/requirements.lock
	@cat lock.tmp >> docs/requirements.lock
	@rm lock.tmp

clean:
	@rm -rf $(VENV) build dist stillhook-demo .pytest_cache .ruff_cache .mypy_cache .hypothesis .import_linter_cache lock.tmp
	@find . -name __pycache__ -type d -prune -exec rm -rf {} +
