# Rules of three kinds: a result from data and models, a figure or table from results, and what takes hours and is published.
# A rule names the data that its product is made from. Products are also made again when the code of their kind changes;
# `make -B` makes them again for any other reason. `make help` lists the targets.

SHELL := /bin/bash
.SHELLFLAGS := -eu -o pipefail -c
.DEFAULT_GOAL := help
.DELETE_ON_ERROR:
MAKEFLAGS += --no-builtin-rules
# What a rule runs says itself what it makes, or `echo` does.
.SILENT:

VENV := .venv
PY := $(VENV)/bin/python
INSTALLED := $(VENV)/.installed
SMALL := $(shell grep -s small $(INSTALLED))

# Folders of results and of published files; `make smoke` and `make paper-from-scratch` choose others.
OUT ?= results
PUBLISHED ?= published
CONFIGS ?= experiments/configs
# `$(SUMS) PATH ...` renews the lines of these files and folders; the others stay, so that `make verify` still finds a damaged file.
SUMS := bash -euo pipefail -c 'cd $(PUBLISHED); exec 9< .; flock 9; touch SHA256SUMS; for path in "$${@\#$(PUBLISHED)/}"; do \
	{ grep -vE "  $$path(/|$$)" SHA256SUMS || true; find "$$path" -type f ! -name "*SHA256SUMS*" ! -path "*/.*" -exec sha256sum {} +; } | \
	LC_ALL=C sort -k 2 > SHA256SUMS.new; mv SHA256SUMS.new SHA256SUMS; done' sums
DATASET := $(PUBLISHED)/dataset.h5
MODELS := $(PUBLISHED)/models
GATHER := $(PY) -m experiments.run_folders $(MODELS)
M1 := $(MODELS) $(foreach model,M1-concat $(notdir $(wildcard $(MODELS)/M1-concat-paper)),$(addprefix $(MODELS)/$(model)/,run.json model.weights.h5 scaling.json))
MEASURED := $(PUBLISHED)/measurements
SOLVER := bem/methods/version.py
# A published file that is missing is not made on the way: what reads it names the command that makes it, or does without.
$(PUBLISHED)/%: ;

##@ The paper, from published results (minutes)

setup: $(INSTALLED)  ## Create .venv with the locked dependencies, 3 GB (Python 3.11 or 3.12; PYTHON=... chooses one)
	@! grep -qs small $(INSTALLED) || $(MAKE) --no-print-directory --always-make $(INSTALLED) SMALL=
setup-small:  ## Only what simulates, predicts and redraws the paper, 1 GB (any Python from 3.11 on)
	@[ -e $(INSTALLED) ] || $(MAKE) --no-print-directory $(INSTALLED) SMALL=small
$(INSTALLED): requirements/$(if $(SMALL),use,work).lock pyproject.toml
	@tools/setup.sh $(VENV) $<
	@echo "$(SMALL)" > $@
verify: | $(INSTALLED)  ## Compare the published files with their SHA-256 sums
	@cd published && sha256sum --check --quiet SHA256SUMS && echo "$$(wc -l < SHA256SUMS) published files are as they were published"
sums:
	$(SUMS) $(FILES)
paper: figures tables report  ## Figures, tables and the report

# A module is a target of its name.
named = $(subst _,-,$(filter-out __init__,$(basename $(notdir $(wildcard $1)))))
# What the paper has no figure of: seeds of both recipes, and the rule of the plateau.
COMPARISONS := figure-ranking figure-plateau
PAPER_FIGURES := $(filter-out $(COMPARISONS),$(call named,paper_figures/figures/*.py paper_figures/models/*.py))
PAPER_TABLES := table-protocols-dataset table-protocols-canonical table-quartiles table-persson-brener table-models table-ranking
# All together go on without what Keras or a result that takes hours would be needed for; what is asked for alone does not.
LEAVE_OUT :=
figures tables: LEAVE_OUT := --leave-out
figures: $(PAPER_FIGURES) $(COMPARISONS)  ## Every figure of the paper whose inputs are published, and two comparisons
tables: $(PAPER_TABLES)  ## Every table of the paper
figures tables:
	echo "All are in $(OUT)/$@"
report: studies | $(INSTALLED)  ## Write REPRODUCTION.md: each number of the paper, and ours
	$(PY) -m paper_figures.report.write --results $(OUT) --published $(PUBLISHED) --out $(or $(REPORT),REPRODUCTION.md)

##@ Figures, tables and studies (short)

COST_FIGURES := $(call named,paper_figures/measurements/*.py)
COST_TABLES := $(filter-out $(PAPER_TABLES),$(call named,paper_figures/tables/*.py))
cost-figures: $(COST_FIGURES) $(COST_TABLES)  ## All figures and tables of costs, errors and difficult cases
$(PAPER_FIGURES) $(COMPARISONS) $(COST_FIGURES): %: $(OUT)/figures/%.pdf
$(PAPER_TABLES) $(COST_TABLES): table-%: $(OUT)/tables/%.md
	$(if $(filter $@,$(MAKECMDGOALS)),cat $<)

F := $(OUT)/figures
T := $(OUT)/tables
S := $(OUT)/studies
# A product is drawn from its prerequisites in their order; what may be missing comes last.
DRAWING := $(wildcard paper_figures/*.* paper_figures/*/*.*)
DRAW = $(PY) -m paper_figures $1 $(filter-out $(DRAWING),$^) --out $@ $(LEAVE_OUT)
$(F)/%.pdf: $(DRAWING) | $(INSTALLED)
	$(call DRAW,$*)
$(T)/%.md: $(DRAWING) | $(INSTALLED)
	$(call DRAW,table-$*)
RANKING := $(wildcard $(PUBLISHED)/ranking.json)
RECIPE_SEEDS := $(PUBLISHED)/paper_recipe_seeds.h5
SPEED := $(wildcard $(MEASURED)/training_speed.json)
$(F)/figure-1.pdf $(F)/figure-3.pdf: $(S)/dataset_examples.json
$(F)/figure-2.pdf: $(S)/dataset_examples.json $(DATASET)
$(F)/figure-4.pdf $(F)/figure-architectures.pdf: $(S)/architecture_graphs.json
$(F)/figure-5.pdf: $(S)/model_comparison.json $(S)/persson_brener.json $(PUBLISHED)/data_efficiency.json $(RANKING)
$(F)/figure-6.pdf $(T)/protocols-canonical.md: $(S)/canonical_regimes.json
$(F)/figure-7.pdf $(T)/quartiles.md: $(S)/error_statistics.json
$(F)/figure-mse-mae.pdf $(F)/figure-learning-curves.pdf: $(S)/model_comparison.json $(RANKING)
$(F)/figure-plateau.pdf: $(S)/model_comparison.json
$(F)/figure-ranking.pdf $(T)/ranking.md: $(PUBLISHED)/ranking.json $(S)/model_comparison.json
$(F)/figure-features.pdf: $(PUBLISHED)/feature_sets.json $(PUBLISHED)/data_efficiency.json $(S)/model_comparison.json $(RANKING)
$(F)/figure-fms-transfer.pdf: $(S)/fms_transfer.json
$(F)/graphical-abstract.pdf: $(S)/canonical_regimes.json $(S)/error_statistics.json
$(T)/protocols-dataset.md: $(S)/dataset_examples.json $(S)/dataset_statistics.json
$(T)/persson-brener.md: $(S)/persson_brener.json
$(T)/models.md: $(S)/model_comparison.json $(SPEED) $(if $(SPEED),$(wildcard $(PUBLISHED)/model_forces.json))
$(F)/figure-effects.pdf: $(MEASURED)/effects.json $(MEASURED)/effect_pairs.json
$(F)/figure-accuracy-cost.pdf: $(MEASURED)/accuracy_cost.json $(MEASURED)/peers.json
$(F)/figure-tabor-cost.pdf: $(MEASURED)/tabor_cost.json
$(F)/figure-amortisation.pdf: $(MEASURED)/amortisation.json
$(F)/figure-training-cost.pdf: $(MEASURED)/training_cost.json
$(F)/figure-peers.pdf $(T)/peers.md: $(MEASURED)/peers.json
$(T)/stand-ins.md: $(MEASURED)/effects.json
$(T)/accuracy-cost.md: $(MEASURED)/accuracy_cost.json
$(T)/hard-cases.md: $(MEASURED)/hard_case_map.json $(wildcard $(MEASURED)/soak.json)
$(T)/surrogates.md: $(MEASURED)/accuracy_cost.json $(PUBLISHED)/pretrained

STUDIES := $(filter-out __init__,$(basename $(notdir $(wildcard experiments/paper/*.py))))
studies: $(STUDIES:%=$(S)/%.json)  ## Every study that trains nothing
# The arguments of a study are its prerequisites without code, the paper's values, the files in the folder of models and more seeds.
STUDY = $(PY) -m experiments $(subst -,_,$1) $(filter-out %.py experiments/paper_values/% $(MODELS)/% $(RECIPE_SEEDS),$^)
$(S)/%.json: experiments/paper/%.py $(wildcard experiments/*.py experiments/paper_values/*) | $(INSTALLED)
	$(call STUDY,$*) --out $@ $(LEAVE_OUT)
$(S)/dataset_examples.json: $(SOLVER)
$(S)/dataset_statistics.json $(S)/inconsistencies.json: $(DATASET) $(SOLVER)
$(S)/canonical_regimes.json: $(CONFIGS)/canonical_regimes.toml $(M1) $(MEASURED)/canonical_times.json $(SOLVER)
$(S)/persson_brener.json: $(CONFIGS)/persson_brener.toml $(M1) $(SOLVER)
$(S)/error_statistics.json: $(CONFIGS)/error_statistics.toml $(M1) $(wildcard $(MODELS)/trainings.h5) $(DATASET)
$(S)/fms_transfer.json: $(CONFIGS)/fms_transfer.toml $(M1) $(DATASET) $(SOLVER)
# The folder changes if an entry is removed, which a wildcard does not show.
$(S)/model_comparison.json: $(MODELS) $(wildcard $(MODELS)/*/run.json) $(DATASET)
$(S)/recipe_seeds.json: $(MODELS) $(wildcard $(MODELS)/*/run.json $(RECIPE_SEEDS)) $(DATASET) $(RANKING)
$(S)/open_choices.json: $(MODELS) $(wildcard $(MODELS)/*-paper/*) $(DATASET) $(SOLVER)
$(S)/architecture_graphs.json: $(wildcard surrogate/architectures/*.py)
$(S)/adopted_settings.json: $(CONFIGS)/feature_sets.toml

##@ Data set and trainings (long; Ctrl-C interrupts them, the same command continues)

COUNT ?= 12450
require-full-dataset:
	@if [ "$(COUNT)" != 12450 ] && [ "$$(realpath -m "$(PUBLISHED)")" = "$$(realpath -m published)" ]; then \
		echo "only all 12450 trajectories go to published/; with COUNT=$(COUNT), give OUT=... and PUBLISHED=..." >&2; exit 1; fi

CAMPAIGN = $(VENV)/bin/bem campaign --design paper --count $(COUNT) --seed 0 --accuracy standard
dataset: setup require-full-dataset  ## Simulate the 12,450 trajectories and publish them; continues after an interruption
	@mkdir -p $(PUBLISHED) $(OUT)/dataset
	$(CAMPAIGN) --replace --out $(OUT)/dataset/dataset.h5
	cp -p $(OUT)/dataset/dataset.h5 $(DATASET).writing && mv $(DATASET).writing $(DATASET)
	$(SUMS) $(DATASET)

# Not published: nine times as many trajectories, and the sets that a file lists.
SETS := experiments/configs/data_sets.txt
.PRECIOUS: $(OUT)/dataset/%.h5
$(OUT)/dataset/%.h5: $(SOLVER) | $(INSTALLED)
	@mkdir -p $(@D)
	$(CAMPAIGN) --replace --out $@
	@touch $@
$(OUT)/dataset/extra.h5: CAMPAIGN = $(VENV)/bin/bem campaign --design paper --seed 1 --count $(or $(EXTRA),$(shell echo $$((9 * $(COUNT))))) --accuracy standard
$(OUT)/dataset/solids/%.h5: CAMPAIGN = $(VENV)/bin/bem campaign $(shell sed -n 's|^$(@:$(OUT)/dataset/%.h5=%)  *||p' $(SETS))

RECIPE ?= swift
# ONLY names the models to train, by default all 18 paper models; EPOCHS replaces the epochs of the recipe.
ONLY ?= $(foreach family,M1 M2 M3 M4 M5 M6,$(addprefix $(family)-,concat FiLM gated))
LASTING = $(addprefix --epochs ,$(EPOCHS))
PAPER_RECIPE = $(addprefix -,$(filter paper,$(RECIPE)))
TRAINING = --dataset $(DATASET) --threads 1 --runs $(OUT)/training --models $(MODELS)
models: $(ONLY:%=model-%)  ## Train and publish the models that are not published yet; -j2 trains two at a time (hours; RECIPE=paper: days, as MODEL-paper)
$(ONLY:%=model-%): NAME = $*
$(ONLY:%=model-%): LABEL = $*$(PAPER_RECIPE)
$(ONLY:%=model-%): HOW = --recipe $(RECIPE) $(LASTING)

# Models besides the 18: MODEL trained in another way. Inputs C have the least error of A to D.
MODEL ?= M1-concat
BESIDE := $(addprefix model-,paper-recipe as-worded inputs-a inputs-b inputs-c large 8-epochs 15-epochs 60-epochs)
NAME = $(MODEL)
LABEL = $(MODEL)-$*
HOW = --recipe swift --epochs $(or $(EPOCHS),$(*:%-epochs=%))
# Each in a folder of its own, unless it is published. Trainings at a time gather and list their files one after the other.
$(ONLY:%=model-%) $(BESIDE): model-%: $(DATASET) | $(INSTALLED)
	[ -f $(MODELS)/$(LABEL)/run.json ] || $(VENV)/bin/surrogate train $(NAME) --label $(LABEL) $(HOW) $(TRAINING)
	flock $(PUBLISHED) $(GATHER)
	$(SUMS) $(MODELS)
model-paper-recipe: LABEL = $(MODEL)-paper
model-paper-recipe: HOW = --recipe paper $(LASTING)  ## Train MODEL, by default M1-concat, by the paper's own recipe, as MODEL-paper (hours)
model-as-worded: HOW = --recipe paper-as-worded $(LASTING)  ## Train it by the words of the paper, without Keras's threshold, as MODEL-as-worded (hours)
model-inputs-%: LABEL = $(MODEL)-inputs-$(SET)$(PAPER_RECIPE)
model-inputs-%: HOW = --recipe $(RECIPE) --features $(SET) $(LASTING)
model-inputs-%: SET = $(subst a,A,$(subst b,B,$(subst c,C,$(@:model-inputs-%=%))))
model-inputs-c:  ## Train it on the input representation C, as MODEL-inputs-C (also model-inputs-a, -b; RECIPE=paper)
model-large: HOW = --recipe swift --features C --extra $(OUT)/dataset/extra.h5 --epochs $(or $(EPOCHS),5)
model-large: $(if $(wildcard $(MODELS)/$(MODEL)-large/run.json),,$(OUT)/dataset/extra.h5)  ## Train it on ten times the data (simulated first) and inputs C
model-budgets: model-8-epochs model-15-epochs model-60-epochs  ## Train it for 8, 15 and 60 epochs, for the figure of error against core minutes
more-models: $(or $(MORE_MODELS),model-paper-recipe model-budgets model-inputs-c model-large)  ## The four targets above: another recipe, fewer and more epochs, other inputs, more data

# Any linear solid: by training, calibration and place of judgement a data set each, the last two at accuracy 1e-3.
SOLIDS := $(OUT)/dataset/solids
TRUTH := $(patsubst %,$(SOLIDS)/calibration_%.h5,prony edges corners broad far power elastic)
PLACES := $(patsubst %,$(SOLIDS)/test_%.h5,prony_2_4 sls power_law polyurea ratio_0.1 slow_unloading elastic edges corners)
SPECTRA_OF := $(patsubst %,$(SOLIDS)/%.h5,prony broad_1 broad_2 power)
FITTED := $(patsubst %,$(SOLIDS)/fit_%.h5,prony broad edges corners)
pretrained: train-fast train-accurate judge-fast judge-accurate  ## Train `fast` and `accurate` and publish them (simulates 373,000 trajectories first), and judge them
train-accurate: UNITS = --units 512 512 512
train-fast train-accurate: train-%: setup $(SPECTRA_OF) $(FITTED) $(TRUTH)
	$(PY) -m surrogate.training.solids --data $(SPECTRA_OF) --runs $(OUT)/solids/$* --publish $(PUBLISHED)/pretrained/$* $(UNITS) $(if $(EPOCHS),--epochs $(EPOCHS) $(EPOCHS))
	$(PY) -m surrogate.training.solid_judgement $(PUBLISHED)/pretrained/$* --fit $(FITTED) --calibrate $(TRUTH)
judge-fast:  ## Compare `fast` with the converged solver, place by place (simulates 44,400 contacts first, in an hour of one core)
judge-accurate:  ## Compare `accurate` likewise
judge-fast judge-accurate: judge-%: setup $(PLACES)
	$(PY) -m surrogate.training.solid_judgement $(PUBLISHED)/pretrained/$* --judge $(PLACES)
	$(SUMS) $(PUBLISHED)/pretrained

paper-recipe-seeds: | $(INSTALLED)  ## Add finished trainings by the paper's recipe, FOLDERS=..., to the published seeds
	$(PY) -m experiments.paper.recipe_seeds $(FOLDERS)
	$(SUMS) $(RECIPE_SEEDS) $(RECIPE_SEEDS:h5=json)

PUBLISHED_STUDIES := feature-sets data-efficiency ranking model-forces threshold equal-parameters
JSON = $(PUBLISHED)/$(subst -,_,$@).json
OWN = --out $(JSON)
feature-sets: $(CONFIGS)/feature_sets.toml $(DATASET) $(MODELS)  ## Train the input representations A to D and publish their errors
data-efficiency: $(CONFIGS)/data_efficiency.toml $(DATASET) $(MODELS)  ## Train on decreasing shares of the data and publish the errors
threshold: $(DATASET) $(MODELS)  ## Train M1-concat on forces in the unit in which its MSE is nearest to the paper's (an hour)
equal-parameters: $(DATASET) $(MODELS)  ## Train M3, M5 and M6 with the parameters of M1-concat (hours)
OWN_WORK = $(JSON) --work $(OUT)/training_studies/$(subst -,_,$@)
feature-sets data-efficiency: OWN = $(OWN_WORK)
threshold equal-parameters: OWN = --out $(OWN_WORK)
ranking: $(DATASET) $(PUBLISHED)/seeds.h5  ## Rank the models by every published seed, with intervals, and publish it (seconds)
model-forces: $(DATASET) $(MODELS)  ## Publish which models were trained on the forces of the published data set
$(PUBLISHED_STUDIES): | $(INSTALLED)
	status=0; $(call STUDY,$@) $(OWN) || status=$$?; [ ! -e $(JSON) ] || $(SUMS) $(JSON); exit $$status

cards: setup  ## Write the cards of the data set and of each published model, and the metadata
	$(PY) -m paper_figures.report.cards --published $(PUBLISHED)
	$(SUMS) $(PUBLISHED)/README.md $(PUBLISHED)/dataset.croissant.json $(PUBLISHED)/models $(PUBLISHED)/pretrained

# A stage needs the one before it. The paper's table of times is measured only where there is none.
STAGES := dataset models more-models feature-sets data-efficiency $(if $(wildcard $(MEASURED)/canonical_times.json),,measure-canonical-times) paper
from-scratch:
	+for stage in $(STAGES); do echo "Stage $$stage"; $(MAKE) --no-print-directory $$stage; done
SCRATCH := results/scratch
SMOKE ?= results/smoke
TINY := CONFIGS=experiments/configs/smoke COUNT=120 EPOCHS=1 ONLY="M1-concat M4-FiLM" MORE_MODELS=model-large EXTRA=40
paper-from-scratch smoke: WHERE = $(if $(filter smoke,$@),$(SMOKE),$(SCRATCH))
paper-from-scratch:  ## Compute everything into results/scratch without published files (16 hours with -j2); resumes
smoke:  ## The same steps on tiny data with one epoch, in minutes; the numbers have no meaning
paper-from-scratch smoke: setup
	@mkdir -p $(WHERE)
	+$(MAKE) --no-print-directory from-scratch BUSY=yes OUT=$(WHERE) PUBLISHED=$(WHERE)/published REPORT=$(WHERE)/REPRODUCTION.md \
		$(if $(filter smoke,$@),$(TINY))

##@ Measurements (long, need an idle machine, and are published)

# BLAS and the backends of the surrogates must use one core only.
measure-%: | $(INSTALLED)  ## Any measurement, with its usual options (BUSY=yes publishes it even if the machine was busy)
	OMP_NUM_THREADS=1 $(call STUDY,$*) --out $(MEASURED)/$(subst -,_,$*).json $(if $(BUSY),--busy)
	$(SUMS) $(MEASURED)/$(subst -,_,$*).json
measure-accuracy-cost: $(DATASET) $(MODELS)
measure-paper-method-times: $(DATASET)
measure-canonical-times: $(CONFIGS)/canonical_times.toml $(MODELS)
measure-training-speed: $(DATASET)
measure-training-cost: $(DATASET) $(MODELS) $(SPEED)
measure-amortisation: $(MEASURED)/accuracy_cost.json $(DATASET) $(MODELS) $(SPEED)
measure-speed: | $(INSTALLED)  ## Compare the solver with that of another revision (REVISION=b10bbed), in turns, and print the table
	$(PY) -m experiments speed --revision $(or $(REVISION),b10bbed) --out $(if $(REVISION),$(OUT),$(MEASURED))/speed.json $(if $(BUSY),--busy)
	$(if $(REVISION),,$(SUMS) $(MEASURED)/speed.json)
MEASUREMENTS := effects effect-pairs canonical-times paper-method-times accuracy-cost tabor-cost training-speed training-cost \
	amortisation hard-case-map outside-ranges gradients \
	lab-coverage limits
measurements:  ## All measurements but those that need long, a browser or other files, one after the other
	+for name in $(MEASUREMENTS); do $(MAKE) --no-print-directory measure-$$name; done

##@ Development

TEST_WORKERS ?= 2
test: lint  ## Everything continuous integration runs: lint, format, types, fast tests
	$(PY) -m pytest -n $(TEST_WORKERS) --max-worker-restart 0 --dist loadfile
test-slow: setup  ## Run the long tests
	$(PY) -m pytest -n $(TEST_WORKERS) --max-worker-restart 0 -m slow
# What OpenBLAS, NumPy and Numba choose on a processor without AVX-512, and on one without AVX2 and FMA.
AVX512 := AVX512F AVX512CD AVX512_SKX AVX512_CLX AVX512_CNL AVX512_ICL
NUMERICAL = $(PY) -m pytest -n $(TEST_WORKERS) --dist loadfile $(addprefix tests/,bem/lab bem/methods bem/test_simulation.py validation surrogate/data)
test-emulated: setup  ## Run the numerical tests as two older processors compute them
	OPENBLAS_CORETYPE=Haswell NPY_DISABLE_CPU_FEATURES="$(AVX512)" $(NUMERICAL)
	OPENBLAS_CORETYPE=Prescott NPY_DISABLE_CPU_FEATURES="F16C FMA3 AVX2 $(AVX512)" NUMBA_CPU_NAME=generic NUMBA_CPU_FEATURES= $(NUMERICAL)
test-torch: .torch/.installed  ## Test architectures and training under PyTorch, which goes into .torch (1 GB, or more with code for graphics cards)
	PYTHONPATH=.torch KERAS_BACKEND=torch $(PY) -m pytest tests/surrogate/architectures
	PYTHONPATH=.torch $(PY) -m pytest tests/surrogate/training/test_other_backends.py -k torch
# PyTorch has no hash: its builds for processors and for graphics cards share one version.
.torch/.installed: | $(INSTALLED)
	$(PY) -m pip install --quiet --upgrade --target $(@D) torch==2.13.0
	@touch $@
test-minima: setup  ## Test quickly with the lowest versions that pyproject.toml allows, in .venv-minima (2 GB)
	$(VENV)/bin/uv venv --quiet --clear --python $(PY) .venv-minima
	$(VENV)/bin/uv pip install --quiet --python .venv-minima --resolution lowest-direct $(GROUPS) --requirement pyproject.toml
	.venv-minima/bin/python -m bem simulate --help > /dev/null
	.venv-minima/bin/python -m surrogate predict fast --tabor 1 --peak-indentation 10 --loading-rate 10 --dwell-time 0.1 --unloading-rate 10
	NUMBA_CACHE_DIR=.venv-minima/kernels .venv-minima/bin/python -m pytest tests/bem/methods/test_version.py tests/bem/results/test_trajectory.py \
		tests/bem/lab/test_units.py tests/bem/lab/test_reading.py tests/surrogate/data tests/surrogate/architectures/test_registry.py
golden-trajectories: setup  ## Update the trajectories that guard the solver's results, after its version was raised
	$(PY) -m tests.bem.methods.golden_trajectories
lint: setup  ## Check style, and the types of the public interface
	$(PY) -m ruff check .
	$(PY) -m ruff format --check .
	$(VENV)/bin/lint-imports --no-logo --no-cache
	$(PY) -m mypy
format: setup  ## Format the code
	$(PY) -m ruff check --fix .
	$(PY) -m ruff format .
# Without `peers`, which pin what they need; setuptools installs this package without the network.
GROUPS := $(addprefix --extra ,train cluster lab tables) --group dev
LOCK = $(VENV)/bin/uv pip compile --quiet --universal --python-version 3.11 --generate-hashes --no-header --output-file
lock:  ## Resolve pyproject.toml again into both lock files (needs the network)
	$(LOCK) requirements/work.lock $(GROUPS) pyproject.toml
	echo 'setuptools>=77' | $(LOCK) requirements/use.lock --no-annotate --extra tables --constraint requirements/work.lock pyproject.toml -
clean:  ## Remove caches and build files; never results/, published/ or .venv
	echo "Removing caches and build files"
	rm -rf build dist *.egg-info .mypy_cache .pytest_cache .ruff_cache .hypothesis
	find . -path ./$(VENV) -prune -o -path ./results -prune -o -path ./published -prune -o -type d -name __pycache__ -exec rm -rf {} +

##@ Documentation and demonstrator

# Pages of the tutorials are kept until a tutorial or the solver changes.
docs/gallery/.solver: $(SOLVER)
	rm -rf $(@D) && mkdir -p $(@D) && touch $@
docs: setup figures tables docs/gallery/.solver  ## Build the documentation into build/site, with its tutorials (4 minutes the first time); a broken link fails
	@$(PY) -m bem compile > /dev/null  # so that no tutorial shows that it compiles
	echo "Building build/site"
	OMP_NUM_THREADS=1 NO_MKDOCS_2_WARNING=1 $(PY) -m mkdocs build --config-file .mkdocs.yml --strict --quiet
docs-numbers: setup  ## Write the published numbers into all documents
	echo "Writing numbers into the documents"
	$(PY) tools/fill.py
readme-pictures: setup figure-effects figure-accuracy-cost  ## Update the pictures of README and guide
	$(VENV)/bin/bem simulate --peak-indentation 5 --loading-rate 10 --dwell-time 0.5 --unloading-rate 10 \
		--filmstrip docs/images/contact.png --animate docs/images/contact.gif
	$(VENV)/bin/bem simulate --plot docs/images/first-trajectory.png
	$(VENV)/bin/surrogate predict accurate --check --plot docs/images/first-prediction.png
	cp $(addprefix $(OUT)/figures/,figure-effects.png figure-accuracy-cost.png) docs/images/
	$(VENV)/bin/bem fit examples/measured_tissue.csv --radius 18.64um --stiffness 0.010951N/m --force-sign compression \
		--plot docs/images/measured-tissue.png

DEMO_MODEL ?= published/models/M1-concat/model.onnx
demo-build: demo/node_modules/.installed  ## Build the browser demonstrator into demo/dist (Node 18 or newer; DEMO_MODEL=... chooses the ONNX file)
	node demo/build.mjs $(DEMO_MODEL)
demo: demo-build  ## Build the demonstrator and serve it at http://localhost:8000 (DEMO_PORT=... chooses the port)
	@python3 -m http.server --bind 127.0.0.1 --directory demo/dist $(or $(DEMO_PORT),8000)
test-demo: setup  ## Test the demonstrator in headless Chromium against Python; installs missing Debian packages
	tests/demo/run.sh $(DEMO_MODEL)
demo-curves: setup  ## Choose and simulate the solver curves of the demonstrator (curves.json, solids.json and contacts.json in demo/public)
	$(PY) -m experiments.demo_curves
demo-models: setup  ## Write the numbers of fast for the demonstrator (demo/public/fast.bin)
	$(PY) -m experiments.demo_model
demo-card: demo-build  ## Take the picture of links to the demonstrator (demo/public/card.png; CHROMIUM=... chooses the browser)
	cd demo && node card.mjs $(or $(CHROMIUM),$$(command -v chromium))
demo/node_modules/.installed: demo/package.json demo/package-lock.json demo/.npmrc
	@command -v npm >/dev/null || { echo "npm not found; install Node 18 or newer with npm" >&2; exit 1; }
	cd demo && npm ci --silent
	@touch $@

.PHONY: sums paper-recipe-seeds $(PAPER_FIGURES) $(COMPARISONS) $(PAPER_TABLES) $(COST_FIGURES) $(COST_TABLES) $(ONLY:%=model-%) $(BESIDE) $(PUBLISHED_STUDIES) setup setup-small verify paper \
	figures tables report cost-figures studies require-full-dataset dataset models model-budgets more-models pretrained train-fast train-accurate judge-fast judge-accurate cards \
	from-scratch paper-from-scratch smoke measurements measure-speed test test-slow test-emulated test-torch test-minima golden-trajectories lint format lock \
	clean docs docs-numbers readme-pictures demo demo-build test-demo demo-curves demo-models demo-card help help-all
help:  ## List the targets that use published results, and the names of the others
	@awk -f tools/help.awk paper_figures/captions.toml Makefile
help-all:  ## List every target
	@awk -v all=1 -f tools/help.awk paper_figures/captions.toml Makefile
