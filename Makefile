# Two layers: a result file depends on its inputs, a figure depends on result files. `make help` lists the targets.

SHELL := /bin/bash
.SHELLFLAGS := -eu -o pipefail -c
.DEFAULT_GOAL := help
.DELETE_ON_ERROR:
MAKEFLAGS += --no-builtin-rules

VENV := .venv
PY := $(VENV)/bin/python
INSTALLED := $(VENV)/.installed
TEST_WORKERS ?= 2

##@ General

.PHONY: help
help:  ## Show this list
	@awk 'BEGIN {FS = ":.*## "; printf "Usage: make TARGET\n"} \
		/^##@ / {printf "\n%s\n", substr($$0, 5)} \
		/^[a-zA-Z0-9_.-]+:.*## / {printf "  %-14s %s\n", $$1, $$2}' $(firstword $(MAKEFILE_LIST))

.PHONY: setup
setup: $(INSTALLED)  ## Create .venv with the locked dependencies (Python 3.11 or 3.12; PYTHON=... chooses one)

$(INSTALLED): requirements.lock pyproject.toml
	@chosen=""; \
	for candidate in "$${PYTHON:-}" python3.11 python3.12 python3 python; do \
		[ -n "$$candidate" ] || continue; \
		if "$$candidate" -c 'import ensurepip, sys, venv; sys.exit(not (3, 11) <= sys.version_info[:2] < (3, 13))' \
			>/dev/null 2>&1; then chosen="$$candidate"; break; fi; \
	done; \
	if [ -z "$$chosen" ]; then \
		echo "Python 3.11 or 3.12 (with venv) not found; install one, or name it: make setup PYTHON=/path/to/python" >&2; exit 1; \
	fi; \
	[ -x $(PY) ] || "$$chosen" -m venv $(VENV)
	$(PY) -m pip install --quiet --disable-pip-version-check --require-hashes --requirement requirements.lock
	$(PY) -m pip install --quiet --disable-pip-version-check --no-deps --no-build-isolation --editable .
	@touch $@

.PHONY: clean
clean:  ## Remove caches and build leftovers; never results/, published/ or .venv
	rm -rf build dist *.egg-info .pytest_cache .ruff_cache .hypothesis
	find . -path ./$(VENV) -prune -o -path ./results -prune -o -path ./published -prune \
		-o -type d -name __pycache__ -exec rm -rf {} +

##@ Checks

.PHONY: test
test: check-lock lint  ## Everything continuous integration runs: lock, lint, format, fast tests
	$(PY) -m pytest -n $(TEST_WORKERS)

.PHONY: test-slow
test-slow: setup  ## The tests too costly for every commit
	$(PY) -m pytest -n $(TEST_WORKERS) -m slow

.PHONY: lint
lint: setup  ## Report style problems
	$(PY) -m ruff check .
	$(PY) -m ruff format --check .

.PHONY: format
format: setup  ## Rewrite the code in the house format
	$(PY) -m ruff check --fix .
	$(PY) -m ruff format .

.PHONY: check-lock
check-lock: setup  ## Fail when requirements.lock does not match pyproject.toml
	$(PY) tools/lock.py check

.PHONY: lock
lock:  ## Resolve pyproject.toml anew into requirements.lock (needs the network)
	@[ -x $(VENV)/bin/uv ] || { echo "uv not found in $(VENV); run \`make setup\` first" >&2; exit 1; }
	$(VENV)/bin/uv pip compile --quiet --universal --python-version 3.11 --all-extras --generate-hashes \
		--no-emit-index-url --no-header --output-file requirements.lock pyproject.toml
	$(PY) tools/lock.py stamp

##@ Results (result file <- inputs)

.PHONY: bench-solver
bench-solver: setup  ## Measure accuracy against cost of the contact solver
	$(PY) -m experiments.bench_solver

##@ Figures (figure <- result file)
