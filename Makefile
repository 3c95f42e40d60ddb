# Two commands for a newcomer: make reproduce, make test.
PYTHON ?= python3
FIDELITY ?= paper
EXPERIMENTS ?=
CLAIMS ?= fig5 fig6
# What the report on the paper has: experiments that claims are judged by, with three seeds, and all others with runs.
JUDGED := fig5 fig6 seen grid
STUDIES := fig4 table2 laws calibration readings convergence refinement ablation fitted unprinted map energy hardness materials temperature
TESTS ?= not slow and not nightly
COARSE := $(if $(filter paper,$(FIDELITY)),,fidelity=$(FIDELITY))
VENV := .venv
BIN := $(VENV)/bin
# --no-deps because the locks are complete.
INSTALL := $(BIN)/python -m pip install --quiet --disable-pip-version-check
LOCK := uv pip compile --universal --generate-hashes --no-emit-index-url --no-header --python-version 3.10 pyproject.toml
BIOME := @biomejs/biome@2.6.8

.PHONY: reproduce paper plan-paper test slow nightly validate lint lint-js docs lock benchmark validator clean

# The report on the paper, with Figures 5 and 6 and what three seeds say of the claims; EXPERIMENTS="energy table2" for
# more.  All is drawn once, at the end.
reproduce: $(VENV)/installed
	set -e; for name in $(EXPERIMENTS); do $(BIN)/snowrepro run experiment=$$name $(COARSE) --no-report $(GO_ON); done
	set -e; for name in $(CLAIMS); do $(BIN)/snowrepro claims experiment=$$name $(COARSE) --no-report $(GO_ON); done
	$(BIN)/snowrepro report $(COARSE)

# All of the report on the paper, days of one core: what has no result yet is run.  plan-paper says first what that is.
# Runs that fail (exit code 3) are an outcome, which the report names.
paper: GO_ON = || test $$? -eq 3
paper: EXPERIMENTS := $(STUDIES)
paper: CLAIMS := $(JUDGED)
paper: reproduce

plan-paper: $(VENV)/installed
	set -e; for name in $(STUDIES); do echo "$$name:"; $(BIN)/snowrepro plan experiment=$$name $(COARSE); done
	set -e; for name in $(JUDGED); do echo "$$name:"; $(BIN)/snowrepro plan experiment=$$name seeds=3 $(COARSE); done

test: $(VENV)/all  ## the fast tests
	$(BIN)/python -m pytest -n auto --dist worksteal -m "$(TESTS)"

validate: $(VENV)/all  ## all tests, with a table of what was compared with theory
	$(BIN)/python -m pytest -n auto --validation-page=reports/validation/index.md

slow: $(VENV)/all  ## tests that make test leaves out
	$(BIN)/python -m pytest -n auto --dist worksteal -m slow

nightly: $(VENV)/all  ## the rest: what would make CI too long for every change
	$(BIN)/python -m pytest -n auto --dist worksteal -m nightly

lint: $(VENV)/all
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy

# The viewer's scripts, by the rules of .biome.json.  Only this needs Node.js: who has none, and changes no script, can
# do without; CI cannot.  To have the layout put right: npx with the same version, and "check --write".
lint-js:
	@if command -v npx >/dev/null; then npx --yes $(BIOME) ci --error-on-warnings; \
	else echo "There is no npx (Node.js): the viewer's scripts are not checked." >&2; test -z "$$CI"; fi

docs: $(VENV)/all  ## the documentation as a website, strictly: build/docs/index.html
	$(BIN)/python -m sphinx -b html -W --keep-going -n -E -q -d build/doctrees docs build/docs

benchmark: $(VENV)/installed
	$(BIN)/python benchmarks/speed.py

# What asks of a crate whether it is one, in an environment of its own: tests/report/test_crate.py, else skipped.
validator: $(VENV)/installed
	test -x build/validator/bin/python || $(PYTHON) -m venv build/validator
	$(BIN)/python -c 'from importlib.metadata import requires; \
		print(*(text.split(";")[0] for text in requires("snowrepro") if "validate-crate" in text), sep="\n")' \
		| build/validator/bin/python -m pip install --quiet --disable-pip-version-check --requirement /dev/stdin

# Renew the locked dependencies (needs uv): hashes, no addresses.
lock:
	$(LOCK) --extra dev -o requirements-dev.lock
	$(LOCK) --extra clone -c requirements-dev.lock -o requirements.lock

# What snowrepro runs with.
$(VENV)/installed: requirements.lock pyproject.toml
	$(PYTHON) -c 'import sys; assert (3, 10) <= sys.version_info < (3, 14), "Python 3.10 to 3.13 is needed; try make PYTHON=python3.12"'
	test -x $(BIN)/python || $(PYTHON) -m venv $(VENV)
	$(INSTALL) --require-hashes --no-deps -r $<
	$(INSTALL) --no-deps --no-build-isolation --editable .
	touch $@

# What tests, linters and documentation need beside.
$(VENV)/all: requirements-dev.lock $(VENV)/installed
	$(INSTALL) --require-hashes --no-deps -r $<
	touch $@

clean:
	rm -rf $(VENV) build dist
