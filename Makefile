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

# Where results are computed and where they are published; `make smoke` and `make paper-from-scratch` choose others.
OUT ?= results
PUBLISHED ?= published
COUNT ?= 12450
FIGURES := $(OUT)/figures
TABLES := $(OUT)/tables
DATASET := $(PUBLISHED)/dataset.h5
ACCURACY_PRICE := $(PUBLISHED)/accuracy_price.json
MANIFEST := tools/manifest.py --root $(PUBLISHED)
SOLVER := $(wildcard bem/*.py bem/_support/*.py bem/solver/*.py bem/solver/discretisation/*.py bem/dataset/*.py bem/reference_solutions/*.py)
DRAWING := $(wildcard paper_figures/style/drawing.py paper_figures/style/writing.py paper_figures/style/*.mplstyle experiments/paper_values/dataset.toml)

##@ General

.PHONY: help
help:  ## Show this list
	@awk 'BEGIN {FS = ":.*## "; printf "Usage: make TARGET\n"} \
		/^##@ / {printf "\n%s\n", substr($$0, 5)} \
		/^[a-zA-Z0-9_.-]+:.*## / {printf "  %-24s %s\n", $$1, $$2}' $(MAKEFILE_LIST)

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
	echo "Installing the locked packages into $(VENV): about 3 GB on disk, 3 to 10 minutes with a fast network"; \
	[ -x $(PY) ] || "$$chosen" -m venv $(VENV)
	@$(PY) -m pip install --disable-pip-version-check --require-hashes --requirement requirements.lock
	@$(PY) -m pip install --quiet --disable-pip-version-check --no-deps --no-build-isolation --editable .
	@echo "Compiling the solver for this processor: about a minute"
	@$(VENV)/bin/bem compile
	@touch $@
	@echo "$(VENV) is ready, $$(du -sh $(VENV) | cut -f 1)"

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

.PHONY: golden-trajectories
golden-trajectories: setup  ## Renew the numbers that guard the solver's version, after it was raised
	$(PY) -m experiments.robustness.golden_trajectories

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

.PHONY: docs
docs: setup  ## Build the documentation into build/site; a broken link fails
	NO_MKDOCS_2_WARNING=1 $(PY) -m mkdocs build --strict --quiet

##@ Results (result file <- inputs)

.PHONY: bench-solver
bench-solver: setup  ## Accuracy against cost of the solver, into docs/solver-benchmark.md (BASELINE=REVISION compares instead)
	$(PY) -m experiments.cost.bench_solver $(addprefix --baseline ,$(BASELINE))

.PHONY: table-solver-hard-cases
table-solver-hard-cases: setup  ## Run the solver where it is most likely to break (long); writes docs/solver-hard-cases.md
	$(PY) -m experiments.robustness.hard_cases

.PHONY: only-all-is-published
only-all-is-published:
	@if [ "$(COUNT)" != 12450 ] && [ "$$(realpath -m "$(PUBLISHED)")" = "$$(realpath -m published)" ]; then \
		echo "only all 12450 trajectories go to published/; with COUNT=$(COUNT), give OUT=... and PUBLISHED=..." >&2; exit 1; \
	fi

.PHONY: dataset
dataset: setup only-all-is-published  ## Simulate the 12,450 trajectories and publish them; continues after an interruption
	@mkdir -p $(PUBLISHED) $(OUT)/dataset
	$(VENV)/bin/bem campaign --design paper --count $(COUNT) --seed 0 --accuracy standard --replace --out $(OUT)/dataset/dataset.h5
	cp -p $(OUT)/dataset/dataset.h5 $(DATASET).writing && mv $(DATASET).writing $(DATASET)
	$(PY) $(MANIFEST) add $(DATASET)
	[ $(PUBLISHED) != published ] || $(PY) tools/readme_numbers.py

$(DATASET):
	@echo "$(DATASET) is missing; restore it from the repository, or run \`make dataset\`" >&2; exit 1

$(OUT)/dataset/examples.json: experiments/paper/dataset_examples.py experiments/paper_values/figure_2_protocols.csv \
		$(SOLVER) | $(INSTALLED)
	$(PY) -m experiments.paper.dataset_examples --out $@

$(OUT)/dataset/statistics.json: experiments/paper/dataset_statistics.py $(DATASET) | $(INSTALLED)
	$(PY) -m experiments.paper.dataset_statistics --dataset $(DATASET) --out $@

.PHONY: accuracy-price
accuracy-price: setup  ## Measure what draft, standard and reference cost over the paper's design (long) and publish it
	$(PY) -m experiments.cost.accuracy_price --folder $(OUT)/accuracy_price --out $(ACCURACY_PRICE)
	$(PY) $(MANIFEST) add $(ACCURACY_PRICE)

$(ACCURACY_PRICE):
	@echo "$@ is missing; restore it from the repository, or run \`make accuracy-price\`" >&2; exit 1

.PHONY: verify
verify: setup  ## Compare what is published with its manifest
	$(PY) tools/manifest.py verify

##@ Figures (figure <- result file)

.PHONY: figure-2
figure-2: $(FIGURES)/figure-2.pdf  ## Six trajectories of the data set, and its histograms
$(FIGURES)/figure-2.pdf: paper_figures/figures/figure_2.py $(OUT)/dataset/examples.json $(DATASET) $(DRAWING) | $(INSTALLED)
	$(PY) -m paper_figures.figures.figure_2 --dataset $(DATASET) --examples $(OUT)/dataset/examples.json --folder $(FIGURES)

.PHONY: figure-solver-scaling
figure-solver-scaling: $(FIGURES)/solver-scaling.pdf  ## How the cost of the solver grows with nodes and steps
$(FIGURES)/solver-scaling.pdf: paper_figures/measurements/figure_solver_scaling.py $(PUBLISHED)/measurements/cost_growth.json $(DRAWING) | $(INSTALLED)
	$(PY) -m paper_figures.measurements.figure_solver_scaling --growth $(PUBLISHED)/measurements/cost_growth.json --folder $(FIGURES)

.PHONY: readme-pictures
readme-pictures: setup $(FIGURES)/figure-6.pdf  ## The pictures of the README, by the README's own commands
	@for program in bem surrogate; do \
		command="$$(grep "^$(VENV)/bin/$$program .*--plot" README.md)"; set -x; $${command/--plot /--plot docs/images/}; { set +x; } 2>/dev/null; \
	done
	cp $(FIGURES)/figure-6.png docs/images/figure-6.png

.PHONY: figure-3
figure-3: $(FIGURES)/figure-3.pdf  ## From the solver's time steps to measurement steps
$(FIGURES)/figure-3.pdf: paper_figures/figures/figure_3.py $(OUT)/dataset/examples.json $(DRAWING) | $(INSTALLED)
	$(PY) -m paper_figures.figures.figure_3 --examples $(OUT)/dataset/examples.json --folder $(FIGURES)

.PHONY: table-protocols-dataset
table-protocols-dataset: $(TABLES)/protocols-dataset.md  ## Protocols of figure 2, and the data set beside the paper's
$(TABLES)/protocols-dataset.md: paper_figures/tables/table_protocols_dataset.py $(OUT)/dataset/examples.json \
		$(OUT)/dataset/statistics.json $(DRAWING) | $(INSTALLED)
	$(PY) -m paper_figures.tables.table_protocols_dataset --examples $(OUT)/dataset/examples.json \
		--statistics $(OUT)/dataset/statistics.json --folder $(TABLES)

.PHONY: table-accuracy-price
table-accuracy-price: $(TABLES)/accuracy-price.md  ## What draft, standard and reference cost, as published
$(TABLES)/accuracy-price.md: paper_figures/tables/table_accuracy_price.py $(ACCURACY_PRICE) $(DRAWING) | $(INSTALLED)
	$(PY) -m paper_figures.tables.table_accuracy_price --price $(ACCURACY_PRICE) --folder $(TABLES)

include paper.mk
include costs.mk

##@ Demonstrator

DEMO_MODEL ?= published/models/M1-concat/model.onnx
DEMO_PORT ?= 8000

.PHONY: demo-build
demo-build: demo/node_modules/.installed  ## Build the browser demonstrator into demo/dist (Node 18 or newer; DEMO_MODEL=... chooses the ONNX file)
	node demo/build.mjs $(DEMO_MODEL)

.PHONY: demo
demo: demo-build  ## Build the demonstrator and serve it at http://localhost:8000 (DEMO_PORT=... chooses the port)
	@python3 tools/serve.py demo/dist --port $(DEMO_PORT)

.PHONY: test-demo
test-demo: setup  ## Use the demonstrator in headless Chromium and compare it with Python; installs Debian's packages if missing
	tests/demo/run.sh $(DEMO_MODEL)

.PHONY: demo-curves
demo-curves: setup  ## Choose and simulate the solver curves the demonstrator overlays (demo/public/curves.json)
	$(PY) -m experiments.demo_curves

demo/node_modules/.installed: demo/package.json demo/package-lock.json demo/.npmrc
	@command -v npm >/dev/null || { echo "npm not found; install Node 18 or newer with npm" >&2; exit 1; }
	cd demo && npm ci --silent
	@touch $@
