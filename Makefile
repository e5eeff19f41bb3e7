# Rules of three kinds: a result from data and models, a figure or table from results, and what takes hours and is published.
# A rule names the data that its product is made from. Products are also made again when the code of their kind changes;
# `make -B` makes them again for any other reason. `make help` lists the targets.

SHELL := /bin/bash
.SHELLFLAGS := -eu -o pipefail -c
.DEFAULT_GOAL := help
.DELETE_ON_ERROR:
MAKEFLAGS += --no-builtin-rules

# What a user may set. It reaches the shell and names files, so that it is plain words: several of NAMES, else one.
NAMES := ONLY MORE_MODELS PRETRAINED
SETTINGS := $(NAMES) MODEL RECIPE EPOCHS JOBS COUNT EXTRA OUT PUBLISHED CONFIGS SMOKE SCRATCH REPORT VENV TEST_WORKERS \
	BUSY HOURS START DEMO_MODEL DEMO_PORT
UNPLAIN := ; & | < > ( ) { } [ ] * ? ! ' " ` \ % : = $$ \#
faults = $(foreach one,$(UNPLAIN),$(findstring $(one),$(2))) $(filter -%,$(2)) $(subst [$(strip $(2))],,[$(2)]) \
	$(if $(filter $(1),$(NAMES) MODEL),$(findstring /,$(2)) $(filter .%,$(2))) \
	$(filter-out 1,$(words $(if $(filter $(1),$(NAMES)),$(firstword $(2)),$(2))))
$(foreach name,$(SETTINGS),$(if $(filter command environment,$(firstword $(origin $(name)))),$(if $(strip \
	$(call faults,$(name),$(value $(name)))),$(error $(name) must be $(if $(filter $(name),$(NAMES)),plain names,a plain \
	$(if $(filter MODEL,$(name)),name,word)) without spaces and signs of the shell; received '$(strip $(value $(name)))'))))

VENV := .venv
PY := $(VENV)/bin/python
INSTALLED := $(VENV)/.installed
SMALL := $(shell grep -s small $(INSTALLED))
# The programs of another checkout's environment run its code, and a link to any environment is not ours to install into.
OWNER := $(if $(filter-out help help-all clean demo demo-build,$(or $(MAKECMDGOALS),help)),$(or $(shell \
	cat $(VENV)/lib/python*/site-packages/__editable__.contact_trajectories-*.pth 2>/dev/null),$(if \
	$(wildcard $(VENV)/pyvenv.cfg),$(filter-out $(abspath $(VENV)),$(realpath $(VENV))))))
$(if $(filter-out $(CURDIR),$(OWNER)),$(error \
	$(VENV) must be an environment of this checkout; received one of $(OWNER); remove $(VENV) and run `make setup`))

# Folders of results and of published files; `make smoke` and `make paper-from-scratch` choose others.
OUT ?= results
PUBLISHED ?= published
CONFIGS ?= experiments/configs
PLACES := --results $(OUT) --published $(PUBLISHED)
SUMS := $(PY) tools/sums.py $(PUBLISHED)

DATASET := $(PUBLISHED)/dataset.h5
MODELS := $(PUBLISHED)/models
M1 := $(addprefix $(MODELS)/M1-concat/,run.json model.weights.h5 scaling.json)
# The folder and its files: the folder changes if an entry is removed, which a wildcard does not show.
ALL_MODELS := $(MODELS) $(wildcard $(MODELS)/*/run.json)
MEASURED := $(PUBLISHED)/measurements
SOLVER := bem/solver/version.py
# A published file that is missing is not made on the way: what reads it names the command that makes it, or does without.
$(PUBLISHED)/%: ;

##@ The paper, from published results (minutes)

.PHONY: setup setup-small verify paper figures tables report
setup: $(INSTALLED)  ## Create .venv with the locked dependencies, 3 GB (Python 3.11 or 3.12; PYTHON=... chooses one)
	@! grep -qs small $(INSTALLED) || $(MAKE) --no-print-directory --always-make $(INSTALLED) SMALL=
setup-small:  ## Only what simulates, predicts and redraws the paper, 1 GB (any Python from 3.11 on)
	@[ -e $(INSTALLED) ] || $(MAKE) --no-print-directory $(INSTALLED) SMALL=small
$(INSTALLED): requirements$(if $(SMALL),-small).lock pyproject.toml
	@tools/setup.sh $(VENV) $<
	@echo "$(SMALL)" > $@

verify: | $(INSTALLED)  ## Compare the published files with their SHA-256 sums
	@cd published && sha256sum --check --quiet SHA256SUMS && echo "$$(wc -l < SHA256SUMS) published files are as they were published"

paper: figures tables report  ## Figures, tables and the report

PAPER_FIGURES := figure-1 figure-2 figure-3 figure-4 figure-5 figure-6 figure-7 figure-architectures figure-mse-mae \
	figure-ranking figure-learning-curves figure-features figure-fms-transfer graphical-abstract
PAPER_TABLES := table-protocols-dataset table-protocols-canonical table-quartiles table-persson-brener table-models \
	table-ranking table-accuracy-price
# Keras, from whose models these are drawn, is no part of the small installation.
WITHOUT_KERAS := $(if $(SMALL),figure-4 figure-architectures)
$(if $(filter setup,$(MAKECMDGOALS)),,$(foreach goal,$(if $(SMALL),$(filter $(WITHOUT_KERAS) report paper studies,$(MAKECMDGOALS))),$(error \
	$(goal) needs Keras, which this small installation leaves out; run `make setup` first)))
# Not drawn as long as nothing that they show is published.
LEFT_OUT := $(WITHOUT_KERAS) \
	$(if $(wildcard $(addprefix $(MODELS)/M[1-6]-,FiLM/run.json gated/run.json)),,figure-learning-curves) \
	$(if $(wildcard $(PUBLISHED)/data_efficiency.json),,figure-5 figure-features) \
	$(if $(wildcard $(PUBLISHED)/feature_sets.json),,figure-features) \
	$(if $(wildcard $(PUBLISHED)/ranking.json),,figure-ranking table-ranking) \
	$(if $(wildcard $(PUBLISHED)/accuracy_price.json),,table-accuracy-price)
figures: $(filter-out $(LEFT_OUT),$(PAPER_FIGURES))  ## Every figure of the paper whose inputs are published
	@$(if $(strip $(LEFT_OUT)),echo "left out as long as Keras is not installed or their results are not published: $(strip $(LEFT_OUT))")
	@echo "figures are in $(OUT)/figures"
tables: $(filter-out $(LEFT_OUT),$(PAPER_TABLES))  ## Every table of the paper
	@echo "tables are in $(OUT)/tables"

REPORT ?= REPRODUCTION.md
report: studies | $(INSTALLED)  ## Write REPRODUCTION.md: each number of the paper, and ours
	$(PY) -m paper_figures.report.write $(PLACES) --out $(REPORT)

##@ Figures, tables and studies (short)

COST_FIGURES := figure-effects figure-accuracy-cost figure-amortisation figure-training-cost figure-peers \
	figure-surrogate-map figure-measurement-floor figure-inverse
COST_TABLES := table-stand-ins table-recommendations table-accuracy-cost table-peers table-hard-cases table-surrogates
.PHONY: cost-figures $(PAPER_FIGURES) $(PAPER_TABLES) $(COST_FIGURES) $(COST_TABLES)
cost-figures: $(COST_FIGURES) $(COST_TABLES)  ## All figures and tables of costs, errors and difficult cases
$(PAPER_FIGURES) $(COST_FIGURES): %: $(OUT)/figures/%.pdf
$(PAPER_TABLES) $(COST_TABLES): table-%: $(OUT)/tables/%.md

F := $(OUT)/figures
T := $(OUT)/tables
S := $(OUT)/studies
DRAWING := $(wildcard paper_figures/*.* paper_figures/*/*.*)
$(F)/%.pdf: $(DRAWING) | $(INSTALLED)
	$(PY) -m paper_figures $* $(PLACES)
$(T)/%.md: $(DRAWING) | $(INSTALLED)
	$(PY) -m paper_figures table-$* $(PLACES)
$(F)/figure-1.pdf $(F)/figure-2.pdf $(F)/figure-3.pdf $(T)/protocols-dataset.md: $(S)/dataset_examples.json
$(F)/figure-2.pdf: $(DATASET)
$(F)/figure-4.pdf $(F)/figure-architectures.pdf: $(S)/architecture_graphs.json
$(F)/figure-5.pdf $(F)/figure-mse-mae.pdf $(F)/figure-learning-curves.pdf $(F)/figure-ranking.pdf $(T)/models.md \
	$(T)/ranking.md: $(S)/model_comparison.json
$(F)/figure-5.pdf $(T)/persson-brener.md: $(S)/persson_brener.json
$(F)/figure-6.pdf $(F)/graphical-abstract.pdf $(T)/protocols-canonical.md: $(S)/canonical_regimes.json
$(F)/figure-7.pdf $(F)/graphical-abstract.pdf $(T)/quartiles.md: $(S)/error_statistics.json
$(F)/figure-fms-transfer.pdf: $(S)/fms_transfer.json
$(T)/protocols-dataset.md: $(S)/dataset_statistics.json
$(F)/figure-5.pdf $(F)/figure-mse-mae.pdf $(F)/figure-ranking.pdf $(F)/figure-learning-curves.pdf $(F)/figure-features.pdf \
	$(T)/ranking.md: $(PUBLISHED)/ranking.json
$(F)/figure-5.pdf $(F)/figure-features.pdf: $(PUBLISHED)/data_efficiency.json
$(F)/figure-features.pdf: $(PUBLISHED)/feature_sets.json
$(T)/models.md: $(PUBLISHED)/model_forces.json $(MEASURED)/training_speed.json
$(T)/accuracy-price.md: $(PUBLISHED)/accuracy_price.json
$(COST_FIGURES:%=$(F)/%.pdf) $(COST_TABLES:table-%=$(T)/%.md): $(wildcard $(MEASURED)/*.json)

STUDIES := dataset_examples dataset_statistics canonical_regimes persson_brener error_statistics fms_transfer \
	model_comparison architecture_graphs adopted_settings inconsistencies
.PHONY: studies
studies: $(STUDIES:%=$(S)/%.json)  ## Every study that trains nothing
$(S)/%.json: experiments/paper/%.py $(wildcard experiments/*.py experiments/paper_values/* $(CONFIGS)/*.toml) | $(INSTALLED)
	$(PY) -m experiments $* $(PLACES) --configs $(CONFIGS)
$(S)/dataset_examples.json: $(SOLVER)
$(S)/dataset_statistics.json: $(DATASET)
$(S)/canonical_regimes.json: $(SOLVER) $(MEASURED)/canonical_times.json $(M1)
$(S)/persson_brener.json: $(SOLVER) $(M1)
$(S)/error_statistics.json: $(DATASET) $(M1) $(wildcard $(MODELS)/M1-concat-paper/test_errors.csv)
$(S)/fms_transfer.json: $(SOLVER) $(DATASET) $(M1)
$(S)/model_comparison.json: $(DATASET) $(ALL_MODELS)
$(S)/architecture_graphs.json: $(wildcard surrogate/architectures/*.py)
$(S)/inconsistencies.json: $(SOLVER) $(DATASET)

##@ Data set and trainings (long; Ctrl-C interrupts them, the same command continues)

.PHONY: require-full-dataset dataset accuracy-price models model-paper-recipe model-inputs-c model-large model-budgets \
	more-models pretrained feature-sets data-efficiency ranking model-forces cards paper-from-scratch smoke from-scratch
COUNT ?= 12450
require-full-dataset:
	@if [ "$(COUNT)" != 12450 ] && [ "$$(realpath -m "$(PUBLISHED)")" = "$$(realpath -m published)" ]; then \
		echo "only all 12450 trajectories go to published/; with COUNT=$(COUNT), give OUT=... and PUBLISHED=..." >&2; exit 1; \
	fi

CAMPAIGN = $(VENV)/bin/bem campaign --design paper --count $(COUNT) --seed 0 --accuracy standard
dataset: setup require-full-dataset  ## Simulate the 12,450 trajectories and publish them; continues after an interruption
	@mkdir -p $(PUBLISHED) $(OUT)/dataset
	$(CAMPAIGN) --replace --out $(OUT)/dataset/dataset.h5
	cp -p $(OUT)/dataset/dataset.h5 $(DATASET).writing && mv $(DATASET).writing $(DATASET)
	$(SUMS) $(DATASET)

# Not published: nine times as many trajectories, from another seed; the same protocols at physical measurement steps; any
# standard linear solid.
EXTRA ?= $(shell echo $$((9 * $(COUNT))))
.PRECIOUS: $(OUT)/dataset/%.h5
$(OUT)/dataset/%.h5: $(SOLVER) | $(INSTALLED)
	@mkdir -p $(@D)
	$(CAMPAIGN) --replace --out $@
	@touch $@
$(OUT)/dataset/extra.h5: CAMPAIGN = $(VENV)/bin/bem campaign --design paper --seed 1 --count $(EXTRA) --accuracy standard
$(OUT)/dataset/physical.h5: CAMPAIGN += --steps physical
ANY_SOLID = $(VENV)/bin/bem campaign --modulus-ratio 0.01:1 --steps physical
$(OUT)/dataset/any_solid.h5: CAMPAIGN = $(ANY_SOLID) --design sobol --count 236016
$(OUT)/dataset/any_solid_edges.h5: CAMPAIGN = $(ANY_SOLID) --design edges --count 150000 --seed 1
$(OUT)/dataset/any_solid_corners.h5: CAMPAIGN = $(ANY_SOLID) --design corners --count 32000 --seed 2
$(OUT)/dataset/any_solid_elastic.h5: CAMPAIGN = $(VENV)/bin/bem campaign --modulus-ratio 0.95:1 --steps physical --design sobol --count 12000 --seed 3

RECIPE ?= swift
JOBS ?= 2
# ONLY names the models to train, by default all 18 paper models; EPOCHS replaces the epochs of the recipe.
ONLY ?=
EPOCHS ?=
TRAINING = --dataset $(DATASET) --threads 1 --runs $(OUT)/training --models $(MODELS)
# A training that is interrupted has published the models that it finished.
models: $(DATASET) | $(INSTALLED)  ## Train and publish the models that are not published yet (hours; RECIPE=paper: days, as MODEL-paper)
	status=0; $(VENV)/bin/surrogate train-all --recipe $(RECIPE) $(addprefix --suffix=-,$(filter paper,$(RECIPE))) --jobs $(JOBS) $(addprefix --only ,$(ONLY)) \
		$(addprefix --epochs ,$(EPOCHS)) $(TRAINING) || status=$$?; [ ! -e $(MODELS) ] || $(SUMS) $(MODELS); exit $$status

# Models besides the 18: MODEL trained in another way, unless LABEL is published. Inputs C have the least error of A to D.
MODEL ?= M1-concat
INPUTS := model-inputs-a model-inputs-b model-inputs-c
BESIDE := model-paper-recipe model-as-worded $(INPUTS) model-large model-8-epochs model-15-epochs model-60-epochs
LABEL = $(MODEL)-$*
HOW = --recipe swift --epochs $(or $(EPOCHS),$(*:%-epochs=%))
.PHONY: $(BESIDE)
$(BESIDE): model-%: $(DATASET) | $(INSTALLED)
	[ -f $(MODELS)/$(LABEL)/run.json ] || $(VENV)/bin/surrogate train $(MODEL) --label $(LABEL) $(HOW) $(TRAINING)
	$(SUMS) $(MODELS)/$(LABEL)
model-paper-recipe: LABEL = $(MODEL)-paper
model-paper-recipe: HOW = --recipe paper $(addprefix --epochs ,$(EPOCHS))
model-as-worded: HOW = --recipe paper-as-worded $(addprefix --epochs ,$(EPOCHS))
model-as-worded:  ## Train MODEL, by default M1-concat, by the words of the paper, without Keras's threshold, as MODEL-as-worded (hours)
model-paper-recipe:  ## Train MODEL, by default M1-concat, by the paper's own recipe, as MODEL-paper (hours)
$(INPUTS): SET = $(shell echo $(@:model-inputs-%=%) | tr abc ABC)
$(INPUTS): LABEL = $(MODEL)-inputs-$(SET)$(addprefix -,$(filter paper,$(RECIPE)))
$(INPUTS): HOW = --recipe $(RECIPE) --features $(SET) $(addprefix --epochs ,$(EPOCHS))
model-inputs-c:  ## Train it on the input representation C, as MODEL-inputs-C (also model-inputs-a, -b; RECIPE=paper)
model-large: HOW = --recipe swift --features C --extra $(OUT)/dataset/extra.h5 --epochs $(or $(EPOCHS),5)
model-large: $(if $(wildcard $(MODELS)/$(MODEL)-large/run.json),,$(OUT)/dataset/extra.h5)  ## Train it on ten times the data (simulated first) and inputs C
model-budgets: model-8-epochs model-15-epochs model-60-epochs  ## Train it for 8, 15 and 60 epochs, for the figure of error against core minutes
MORE_MODELS ?= model-paper-recipe model-budgets model-inputs-c model-large
more-models: $(MORE_MODELS)  ## The four targets above: another recipe, fewer and more epochs, other inputs, more data

PRETRAINED ?= fast accurate
START ?= $(PUBLISHED)/pretrained
pretrained: setup $(addprefix $(OUT)/dataset/any_solid,.h5 _edges.h5 _corners.h5 _elastic.h5)  ## Train `fast` and `accurate` on from START (START=no: anew) and publish them (simulates 430,016 trajectories first)
	$(PY) -m surrogate.training.pretrained $(PRETRAINED) --box $(OUT)/dataset/any_solid.h5 \
		--edges $(OUT)/dataset/any_solid_edges.h5 --corners $(OUT)/dataset/any_solid_corners.h5 \
		--elastic $(OUT)/dataset/any_solid_elastic.h5 --runs $(OUT)/pretrained \
		--publish $(PUBLISHED)/pretrained $(addprefix --start ,$(filter-out no,$(START))) $(addprefix --epochs ,$(EPOCHS))
	$(SUMS) $(PUBLISHED)/pretrained

accuracy-price:  ## Measure what draft, standard and reference cost over the paper's design (long) and publish it
accuracy-price: OWN = --folder $(OUT)/accuracy_price
feature-sets: $(OUT)/dataset/physical.h5  ## Train the input representations A to F, some of them also at physical steps, and publish their errors
feature-sets: OWN = --physical $(OUT)/dataset/physical.h5 --work $(OUT)/training_studies/feature_sets
data-efficiency:  ## Train on decreasing shares of the data and publish the errors
data-efficiency: OWN = --work $(OUT)/training_studies/data_efficiency
ranking:  ## Rank the models by every published seed, with intervals, and publish it (seconds)
model-forces:  ## Publish which models were trained on the forces of the published data set
feature-sets data-efficiency ranking model-forces: $(DATASET)
# What is interrupted has published what it finished.
accuracy-price feature-sets data-efficiency ranking model-forces: JSON = $(PUBLISHED)/$(subst -,_,$@).json
accuracy-price feature-sets data-efficiency ranking model-forces: | $(INSTALLED)
	status=0; $(PY) -m experiments $(subst -,_,$@) $(PLACES) --configs $(CONFIGS) $(OWN) || status=$$?; \
		[ ! -e $(JSON) ] || $(SUMS) $(JSON); exit $$status

cards: setup  ## Write the cards of the data set and of each published model, and the metadata
	$(PY) -m paper_figures.report.cards --published $(PUBLISHED)
	$(SUMS) $(PUBLISHED)/README.md $(PUBLISHED)/dataset.croissant.json $(PUBLISHED)/models $(PUBLISHED)/pretrained

HOURS ?= yes
STAGES := dataset models more-models feature-sets data-efficiency paper
from-scratch:
	+@place=0; for stage in $(STAGES); do \
		place=$$((place + 1)); \
		$(if $(filter no,$(HOURS)),echo "stage $$place of $(words $(STAGES)): $$stage",$(PY) -m experiments.stages $$stage); \
		[ $$stage != paper ] || [ -f $(MEASURED)/canonical_times.json ] || \
			$(MAKE) --no-print-directory measure-canonical-times BUSY=yes; \
		$(MAKE) --no-print-directory $$stage; \
	done
SCRATCH := results/scratch
paper-from-scratch: setup  ## Compute everything into results/scratch without published files; prints the expected hours, resumes
	@$(PY) -m experiments.stages
	@mkdir -p $(SCRATCH)
	+$(MAKE) --no-print-directory from-scratch OUT=$(SCRATCH) PUBLISHED=$(SCRATCH)/published REPORT=$(SCRATCH)/REPRODUCTION.md
SMOKE ?= results/smoke
smoke: setup  ## The same steps on tiny data with one epoch, in minutes; the numbers have no meaning
	@mkdir -p $(SMOKE)
	+$(MAKE) --no-print-directory from-scratch OUT=$(SMOKE) PUBLISHED=$(SMOKE)/published REPORT=$(SMOKE)/REPRODUCTION.md \
		HOURS=no CONFIGS=experiments/configs/smoke COUNT=120 EPOCHS=1 ONLY="M1-concat M4-FiLM" \
		MORE_MODELS=model-large EXTRA=40

##@ Measurements (long, need an idle machine, and are published)

# `.venv/bin/python -m experiments NAME --help` shows the options of each.
BUSY ?=
.PHONY: measurements
# BLAS and the backends of the surrogates must use one core only.
measure-%: | $(INSTALLED)  ## Any measurement, with its usual options (BUSY=yes publishes it even if the machine was busy)
	OMP_NUM_THREADS=1 $(PY) -m experiments $(subst -,_,$*) $(PLACES) --configs $(CONFIGS) $(if $(BUSY),--busy)
	$(if $(filter-out pull-off-place,$*),$(SUMS) $(MEASURED)/$(subst -,_,$*).*)
MEASUREMENTS := effects effect-pairs recommendations canonical-times accuracy-cost campaign-scale training-speed training-cost \
	amortisation hard-case-map measurement-floor pull-off-place errors-by-place pretrained-errors inverse-problem \
	surrogate-map lab-coverage stream-latency
# Two simultaneous measurements would disturb each other.
.NOTPARALLEL: measurements
measurements: $(addprefix measure-,$(MEASUREMENTS))  ## All measurements except the soak and those of other software

##@ Development

TEST_WORKERS ?= 2
.PHONY: test test-slow test-newest-keras golden-trajectories lint format check-lock lock clean
test: check-lock lint  ## Everything continuous integration runs: lock, lint, format, types, fast tests
	$(PY) -m pytest -n $(TEST_WORKERS) --max-worker-restart 0 --dist loadfile
test-slow: setup  ## Run the long tests
	$(PY) -m pytest -n $(TEST_WORKERS) --max-worker-restart 0 -m slow

test-newest-keras: .venv-newest/.installed  ## Test the architectures with the newest Keras under PyTorch, in .venv-newest (2 GB)
	KERAS_BACKEND=torch .venv-newest/bin/python -m pytest tests/surrogate/architectures

# PyTorch has no hash here: its builds for processors and for graphics cards share one version.
.venv-newest/.installed: requirements-newest.txt | $(INSTALLED)
	$(PY) -m venv --clear $(@D)
	$(@D)/bin/python -m pip install --quiet --disable-pip-version-check --require-hashes --requirement $<
	$(@D)/bin/python -m pip install --quiet --disable-pip-version-check torch==2.13.0
	@touch $@
golden-trajectories: setup  ## Update the trajectories that guard the solver's results, after its version was raised
	$(PY) -m tests.bem.solver.golden_trajectories
lint: setup  ## Check style, and the types of the public interface
	$(PY) -m ruff check .
	$(PY) -m ruff format --check .
	$(PY) -m mypy
format: setup  ## Format the code
	$(PY) -m ruff check --fix .
	$(PY) -m ruff format .
check-lock: setup  ## Fail if a lock file does not match pyproject.toml
	$(PY) tools/lock.py check

COMPILE := $(VENV)/bin/uv pip compile --quiet --universal --python-version 3.11 --generate-hashes --no-emit-index-url --no-header
# The last four are what PyTorch needs.
NEWEST := keras pytest hypothesis fsspec jinja2 networkx sympy
lock:  ## Resolve pyproject.toml again into all lock files (needs the network)
	@[ -x $(VENV)/bin/uv ] || { echo "uv not found in $(VENV); run \`make setup\` first" >&2; exit 1; }
	$(COMPILE) --extra train --extra cluster --extra lab --extra tables --extra dev --output-file requirements.lock pyproject.toml
	@# The same versions where they exist, which is below Python 3.13; setuptools installs this package.
	awk -F ' ; ' '/^[a-z].*==/ {sub(/ \\$$/, ""); print $$1 " ; python_full_version < \"3.13\"" ($$2 ? " and (" $$2 ")" : "")}' requirements.lock \
		> $(VENV)/versions.txt
	printf '%s\n' 'setuptools>=77' 'numpy>=2.1; python_version >= "3.13"' | $(COMPILE) --extra tables --constraint $(VENV)/versions.txt \
		--no-annotate --output-file requirements-small.lock pyproject.toml -
	$(PY) tools/lock.py stamp
	printf '%s\n' $(NEWEST) | $(COMPILE) --upgrade --no-annotate --output-file requirements-newest.txt pyproject.toml -

clean:  ## Remove caches and build files; never results/, published/ or .venv
	rm -rf build dist *.egg-info .mypy_cache .pytest_cache .ruff_cache .hypothesis
	find . -path ./$(VENV) -prune -o -path ./results -prune -o -path ./published -prune \
		-o -type d -name __pycache__ -exec rm -rf {} +

##@ Documentation and demonstrator

.PHONY: docs docs-numbers readme-pictures demo-build demo test-demo demo-curves demo-models
# Pages of the tutorials are kept until a tutorial or the solver changes.
TUTORIALS := docs/gallery/.solver
$(TUTORIALS): $(SOLVER)
	rm -rf $(@D)
	mkdir -p $(@D)
	touch $@

docs: setup $(TUTORIALS)  ## Build the documentation into build/site, with its tutorials (4 minutes the first time); a broken link fails
	@$(PY) -m bem compile > /dev/null  # so that no tutorial shows that it compiles
	OMP_NUM_THREADS=1 NO_MKDOCS_2_WARNING=1 $(PY) -m mkdocs build --strict --quiet
docs-numbers: setup  ## Write the published numbers into all documents
	$(PY) tools/fill.py

readme-pictures: setup figure-effects figure-accuracy-cost  ## Update the pictures of README and guide, with their own commands
	grep '^$(VENV)/bin/.*--plot ' README.md | sed -E 's/--(plot|filmstrip|animate) /&docs\/images\//g' | bash -ex
	cp $(addprefix $(OUT)/figures/,figure-effects.png figure-accuracy-cost.png) docs/images/
	for name in cantilever-pull-off measured-tissue plan-dwell plan-release; do $(PY) examples/$${name//-/_}.py docs/images/$$name.png || exit 1; done

DEMO_MODEL ?= published/models/M1-concat/model.onnx
DEMO_PORT ?= 8000
demo-build: demo/node_modules/.installed  ## Build the browser demonstrator into demo/dist (Node 18 or newer; DEMO_MODEL=... chooses the ONNX file)
	node demo/build.mjs $(DEMO_MODEL)
demo: demo-build  ## Build the demonstrator and serve it at http://localhost:8000 (DEMO_PORT=... chooses the port)
	@python3 tools/serve.py demo/dist --port $(DEMO_PORT)
test-demo: setup  ## Test the demonstrator in headless Chromium against Python; installs missing Debian packages
	tests/demo/run.sh $(DEMO_MODEL)
demo-curves: setup  ## Choose and simulate the solver curves of the demonstrator (curves.json, solids.json and contacts.json in demo/public)
	$(PY) -m experiments.demo_curves
demo-models: setup  ## Export the pretrained models for the demonstrator (demo/public/fast.onnx and accurate.onnx)
	for model in fast accurate; do $(PY) -m surrogate export $$model --models $(PUBLISHED)/pretrained --out demo/public/$$model.onnx || exit 1; done

demo/node_modules/.installed: demo/package.json demo/package-lock.json demo/.npmrc
	@command -v npm >/dev/null || { echo "npm not found; install Node 18 or newer with npm" >&2; exit 1; }
	cd demo && npm ci --silent
	@touch $@

.PHONY: help help-all
help:  ## List the targets that use published results, and the names of the others
	@awk -f tools/help.awk paper_figures/captions.toml Makefile
help-all:  ## List every target
	@awk -v all=1 -f tools/help.awk paper_figures/captions.toml Makefile
