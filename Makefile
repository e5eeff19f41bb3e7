# Two layers: a result depends on its inputs, and a figure on results. Each run records the modules, settings and values of
# the paper that it used, in a folder `.depends` beside its result; they are not listed here.
#
# A figure or table is one line of this file, `NAME.GROUP := RESULTS  ## CAPTION`, and one module of `paper_figures`. A
# study is one line and one module of `experiments`. `RESULT?` marks a result that may be missing. `make help` shows the
# captions.

SHELL := /bin/bash
.SHELLFLAGS := -eu -o pipefail -c
.DEFAULT_GOAL := help
.DELETE_ON_ERROR:
.SECONDEXPANSION:
MAKEFLAGS += --no-builtin-rules

VENV := .venv
PY := $(VENV)/bin/python
INSTALLED := $(VENV)/.installed
comma := ,
TEST_WORKERS ?= 2

# Folders of results and of published files; `make smoke` and `make paper-from-scratch` choose others.
OUT ?= results
PUBLISHED ?= published
CONFIGS ?= experiments/configs
COUNT ?= 12450
FIGURES := $(OUT)/figures
TABLES := $(OUT)/tables
STUDIES := $(OUT)/studies
WORK := $(OUT)/training_studies
DATASET := $(PUBLISHED)/dataset.h5
MODELS := $(PUBLISHED)/models
REFERENCE := $(MODELS)/M1-concat
MEASUREMENTS := $(PUBLISHED)/measurements
MANIFEST := tools/manifest.py --root $(PUBLISHED)
PLACES := --results $(OUT) --published $(PUBLISHED)

##@ The paper, from published results (minutes)

.PHONY: setup
setup: $(INSTALLED)  ## Create .venv with the locked dependencies, 3 GB (Python 3.11 or 3.12; PYTHON=... chooses one)
	@! grep -qs small $(INSTALLED) || { \
		$(PY) -c 'import sys; sys.exit(sys.version_info[:2] >= (3, 13))' || { \
			echo "make setup needs Python 3.11 or 3.12, and $(VENV) has a newer one; remove $(VENV) first" >&2; exit 1; }; \
		rm $(INSTALLED); $(MAKE) --no-print-directory $(INSTALLED); \
	}

.PHONY: setup-small
setup-small:  ## Only what simulates, predicts and redraws the paper, 1 GB (any Python from 3.11 on)
	@[ -e $(INSTALLED) ] || $(MAKE) --no-print-directory $(INSTALLED) SMALL=yes

# The small installation takes the locked versions where they exist for its Python, and else the newest.
SMALL := $(if $(SMALL),$(SMALL),$(shell grep -s small $(INSTALLED)))
PYTHONS := $(if $(SMALL),python3 python3.14 python3.13 python3.12 python3.11,python3.11 python3.12 python3) python
BELOW := $(if $(SMALL),(4,),(3, 13))

$(INSTALLED): requirements.lock pyproject.toml
	@chosen=""; \
	for candidate in "$${PYTHON:-}" $(PYTHONS); do \
		[ -n "$$candidate" ] || continue; \
		if "$$candidate" -c 'import ensurepip, sys, venv; sys.exit(not (3, 11) <= sys.version_info[:2] < $(BELOW))' \
			>/dev/null 2>&1; then chosen="$$candidate"; break; fi; \
	done; \
	if [ -z "$$chosen" ]; then \
		echo "Python 3.11 or $(if $(SMALL),newer,3.12) (with venv) not found; install one, or name it: make setup$(if $(SMALL),-small) PYTHON=/path/to/python" >&2; exit 1; \
	fi; \
	echo "Installing the locked packages into $(VENV): about $(if $(SMALL),1 GB on disk$(comma) 1 to 3,3 GB on disk$(comma) 3 to 10) minutes with a fast network"; \
	[ -x $(PY) ] || "$$chosen" -m venv $(VENV)
ifneq ($(SMALL),)
	@grep -oE '^[A-Za-z0-9._-]+==[^\]+' requirements.lock > $(VENV)/versions.txt
	@limit=""; $(PY) -c 'import sys; sys.exit(sys.version_info[:2] >= (3, 13))' && limit="--constraint $(VENV)/versions.txt"; \
		$(PY) -m pip install --disable-pip-version-check $$limit --editable '.[tables]'
else
	@$(PY) -m pip install --disable-pip-version-check --require-hashes --requirement requirements.lock
	@$(PY) -m pip install --quiet --disable-pip-version-check --no-deps --no-build-isolation --editable .
endif
	@echo "Compiling the solver for this processor: about a minute"
	@$(VENV)/bin/bem compile
	@echo "$(if $(SMALL),small)" > $@
	@echo "$(VENV) is ready, $$(du -sh $(VENV) | cut -f 1)"

.PHONY: verify
verify: | $(INSTALLED)  ## Compare the published files with their manifest
	$(PY) tools/manifest.py verify

.PHONY: paper
paper: figures tables report  ## Figures, tables and the report

# A figure is left out, with a message, if none of its inputs is trained yet; the others are drawn.
.PHONY: figures
figures: $$(filter-out table-% $$(LEFT_OUT),$$(PAPER))  ## Every figure of the paper whose inputs are published
	@$(if $(filter figure-learning-curves,$(LEFT_OUT)),echo "figure-learning-curves is left out: no FiLM or gated model is published; \`make models\` trains them")
	@$(if $(filter figure-features,$(LEFT_OUT)),echo "figure-features is left out: \`make feature-sets data-efficiency\` trains what it shows")
	@$(if $(WITHOUT_KERAS),echo "$(WITHOUT_KERAS) are left out: they are drawn from the Keras models; \`make setup\` installs Keras")
	@echo "figures are in $(FIGURES)"

.PHONY: tables
tables: $$(filter-out $$(LEFT_OUT),$$(filter table-%,$$(PAPER)))  ## Every table of the paper
	@echo "tables are in $(TABLES)"

REPORT ?= REPRODUCTION.md
# Its hours and minutes come from the published files.
REPRODUCING ?= $(if $(filter published,$(PUBLISHED)),REPRODUCING.md)
.PHONY: report
report: $$(STUDY_RESULTS) | $(INSTALLED)  ## Write REPRODUCTION.md: each number of the paper, and ours
	$(PY) -m paper_figures.report.write $(PLACES) --out $(REPORT)
	$(if $(REPRODUCING),$(PY) tools/fill.py $(REPRODUCING) --published $(PUBLISHED))

##@ Figures and tables of the paper

figure-1.paper := dataset_examples  ## Contact, gap, protocol and a computed force response
figure-2.paper := dataset_examples dataset  ## Six trajectories of the data set, and its histograms
figure-3.paper := dataset_examples  ## From the solver's time steps to measurement steps
figure-4.paper := architecture_graphs  ## Building blocks and the M1-concat model
figure-5.paper := model_comparison persson_brener data_efficiency? ranking?  ## Models, sizes, crack velocity, data efficiency
figure-6.paper := canonical_regimes  ## The twelve canonical protocols
figure-7.paper := error_statistics  ## Distributions of the held-out errors
figure-architectures.paper := architecture_graphs  ## Diagrams of the 18 paper models, from the Keras models
figure-mse-mae.paper := model_comparison ranking?  ## Held-out MSE against MAE of every trained model
figure-ranking.paper := ranking  ## Held-out errors of every seed, with bootstrap intervals
figure-learning-curves.paper := model_comparison ranking?  ## Validation curves of the FiLM and gated models
figure-features.paper := feature_sets? data_efficiency? ranking?  ## Input representations with a table, and training-set size
figure-fms-transfer.paper := fms_transfer  ## The trained model at other numbers of measurement steps
graphical-abstract.paper := canonical_regimes error_statistics  ## Protocol, surrogate and predicted force
table-protocols-dataset.paper := dataset_examples dataset_statistics  ## Protocols of figure 2, and the data set compared with the paper's
table-protocols-canonical.paper := canonical_regimes  ## Canonical protocols and their cost
table-quartiles.paper := error_statistics  ## Held-out errors by quartile
table-persson-brener.paper := persson_brener  ## Crack velocities and amplifications
table-models.paper := model_comparison training_speed? model_forces? more-models  ## Every trained model: size, errors, cost
table-ranking.paper := ranking  ## Spread over seeds, intervals, and which of the paper's rankings hold
table-accuracy-price.paper := accuracy_price  ## Published cost of draft, standard and reference

##@ Cost and difficult cases (figure <- measurement)

.PHONY: cost-figures
cost-figures: $$(COST)  ## All figures and tables of this group

figure-effects.cost := effects  ## One path under seven scenes, and the errors of simpler scenes
table-effects.cost := effects  ## What each effect costs, and where a simpler scene suffices
table-recommendations.cost := recommendations  ## How often `recommend` meets its tolerance
figure-accuracy-cost.cost := accuracy_cost  ## Seconds against error, every tool on one chart
table-accuracy-cost.cost := accuracy_cost  ## Seconds and errors as a table, and the fastest tool for a wanted error
figure-cost-growth.cost := cost_growth  ## Growth of the cost with fitted powers, and a table
figure-solver-scaling.cost := cost_growth  ## Growth of the solver's cost with nodes and steps
figure-amortisation.cost := amortisation  ## When a surrogate pays for itself, and a table
figure-training-cost.cost := training_cost  ## Error against time of training and number of trajectories
figure-peers.cost := peers  ## Error against time on one elastic sphere, also in other software
table-peers.cost := peers  ## Errors and times on the elastic sphere as a table
figure-hard-cases.cost := hard_case_map soak?  ## Difficult cases of the solver, as a map and a table, and the result of the soak
figure-surrogate-map.cost := surrogate_map  ## Errors of MODEL=M1-concat over the box, its twenty worst trajectories, and a table
figure-measurement-floor.cost := measurement_floor  ## What uniform and physical measurement steps hold of the pull-off force
figure-surrogates.cost := pretrained_errors  ## Where a surrogate wins: error against processor time
table-surrogates.cost := pretrained_errors  ## The same as a table, with the coverage of the bands
figure-inverse.cost := inverse_problem  ## A material with its uncertainty from one force curve, by surrogate and by solver
figure-size-error.cost := size_error  ## Error against the number of parameters, beside the paper's 18 models
figure-broad-band.cost := broad_band  ## Pull-off of broad-band solids over the unloading rate

.PHONY: table-hard-cases
table-hard-cases: figure-hard-cases

# Names with spaces would be several names for make.
$(foreach name,OUT PUBLISHED CONFIGS SMOKE SCRATCH,$(if $(filter-out 0 1,$(words $($(name)))),$(error \
	$(name) must be a path without spaces; received '$($(name))')))

# The model whose errors are drawn. The map of any model but M1-concat is measured if it does not exist.
MODEL ?= M1-concat
ifneq ($(words $(MODEL))$(findstring /,$(MODEL))$(filter .% -%,$(MODEL)),1)
$(error MODEL must be the plain name of a published model; received '$(MODEL)')
endif
ifneq ($(MODEL),M1-concat)
path.surrogate_map := $(OUT)/measurements/surrogate_map-$(MODEL).json
figure-surrogate-map.under := /$(MODEL)
figure-surrogate-map.with := --take surrogate_map=$(path.surrogate_map) --under $(MODEL)
$(path.surrogate_map): $(DATASET) | $(INSTALLED)
	$(PY) -m experiments surrogate_map --model $(MODEL) --dataset $(DATASET) --models $(MODELS) --out $@
endif

##@ Studies (short; result <- data set and models)

.PHONY: studies
studies: $$(STUDY_RESULTS)  ## Every study that trains nothing

dataset_examples.study := solver
dataset_statistics.study := dataset
canonical_regimes.study := solver canonical_times M1-concat
persson_brener.study := solver M1-concat
error_statistics.study := dataset M1-concat
fms_transfer.study := solver dataset M1-concat
model_comparison.study := dataset models M1-concat
architecture_graphs.study := architectures
adopted_settings.study :=
inconsistencies.study := solver dataset

##@ Data set and trainings (long; Ctrl-C interrupts them, the same command continues)

.PHONY: require-full-dataset
require-full-dataset:
	@if [ "$(COUNT)" != 12450 ] && [ "$$(realpath -m "$(PUBLISHED)")" = "$$(realpath -m published)" ]; then \
		echo "only all 12450 trajectories go to published/; with COUNT=$(COUNT), give OUT=... and PUBLISHED=..." >&2; exit 1; \
	fi

.PHONY: dataset
dataset: setup require-full-dataset  ## Simulate the 12,450 trajectories and publish them; continues after an interruption
	@mkdir -p $(PUBLISHED) $(OUT)/dataset
	$(VENV)/bin/bem campaign --design paper --count $(COUNT) --seed 0 --accuracy standard --replace --out $(OUT)/dataset/dataset.h5
	cp -p $(OUT)/dataset/dataset.h5 $(DATASET).writing && mv $(DATASET).writing $(DATASET)
	$(PY) $(MANIFEST) add $(DATASET)
	[ $(PUBLISHED) != published ] || $(PY) tools/fill.py README.md

.PHONY: accuracy-price
accuracy-price.publishes := accuracy_price
accuracy-price: setup  ## Measure what draft, standard and reference cost over the paper's design (long) and publish it
	$(PY) -m experiments accuracy_price --folder $(OUT)/accuracy_price --out $(path.accuracy_price)
	$(PY) $(MANIFEST) add $(path.accuracy_price)

RECIPE ?= swift
JOBS ?= 2
# ONLY names the models to train, by default all 18 paper models; EPOCHS replaces the epochs of the recipe.
ONLY ?=
EPOCHS ?=
# An interrupted command has published the models that it finished.
list_also_unfinished = || status=$$?; [ ! -e $(1) ] || $(PY) $(MANIFEST) add $(1); exit $${status:-0}

.PHONY: models
models: $(DATASET) | $(INSTALLED)  ## Train and publish the models that are not published yet (hours)
	$(VENV)/bin/surrogate train-all --recipe $(RECIPE) --dataset $(DATASET) --jobs $(JOBS) --threads 1 \
		$(addprefix --only ,$(ONLY)) $(addprefix --epochs ,$(EPOCHS)) --runs $(OUT)/training --models $(MODELS) \
		$(call list_also_unfinished,$(MODELS))

# $(call beside,LABEL,OPTIONS,MODEL) trains a model, by default M1-concat, differently from the 18 paper models, unless
# LABEL is published.
define beside
	[ -f $(MODELS)/$(1)/run.json ] || $(VENV)/bin/surrogate train $(or $(3),M1-concat) --label $(1) $(2) --dataset $(DATASET) \
		--threads 1 --runs $(OUT)/training --models $(MODELS)
	$(PY) $(MANIFEST) add $(MODELS)/$(1)
endef

.PHONY: model-paper-recipe
model-paper-recipe: $(DATASET) | $(INSTALLED)  ## Train MODEL, by default M1-concat, by the paper's own recipe, as MODEL-paper (hours)
	$(call beside,$(MODEL)-paper,--recipe paper $(addprefix --epochs ,$(EPOCHS)),$(MODEL))

# Of the four input representations of the paper, the third has the least error (`make feature-sets`).
.PHONY: model-inputs-c
model-inputs-c: $(DATASET) | $(INSTALLED)  ## Train M1-concat on the input representation C, as M1-concat-inputs-C
	$(call beside,M1-concat-inputs-C,--recipe swift --features C $(addprefix --epochs ,$(EPOCHS)))

# Nine times as many additional trajectories, from another seed than that of the data set. They are not published.
EXTRA ?= $(shell echo $$((9 * $(COUNT))))
EXTRA_DATASET := $(OUT)/dataset/extra.h5

.PHONY: model-large
model-large: $(DATASET) | $(INSTALLED)  ## Train M1-concat on ten times the trajectories and inputs C, as M1-concat-large (simulates them first)
	[ -f $(MODELS)/M1-concat-large/run.json ] || $(MAKE) --no-print-directory $(EXTRA_DATASET)
	$(call beside,M1-concat-large,--recipe swift --features C --extra $(EXTRA_DATASET) --epochs $(or $(EPOCHS),5))

.PRECIOUS: $(EXTRA_DATASET)
$(EXTRA_DATASET): bem/solver/version.py | $(INSTALLED)
	$(VENV)/bin/bem campaign --design paper --seed 1 --count $(EXTRA) --accuracy standard --replace --out $@
	@touch $@

.PHONY: model-budgets
model-budgets: $(DATASET) | $(INSTALLED)  ## Train M1-concat for 8, 15 and 60 epochs, for the figure of error against core minutes
	$(call beside,M1-concat-8-epochs,--recipe swift --epochs $(or $(EPOCHS),8))
	$(call beside,M1-concat-15-epochs,--recipe swift --epochs $(or $(EPOCHS),15))
	$(call beside,M1-concat-60-epochs,--recipe swift --epochs $(or $(EPOCHS),60))

MORE_MODELS ?= model-paper-recipe model-budgets model-inputs-c model-large
.PHONY: more-models
more-models: $(MORE_MODELS)  ## Train M1-concat by the four targets above: another recipe, fewer and more epochs, other inputs, more data

# Of any solid, drawn with the protocols; not published.
ANY_SOLID := $(OUT)/dataset/any_solid.h5
PRETRAINED ?= fast accurate
.PHONY: pretrained
pretrained: setup $(ANY_SOLID)  ## Train and publish `fast` and `accurate`, for any standard linear solid (simulates 65,536 trajectories first)
	$(PY) -m surrogate.training.pretrained $(PRETRAINED) --dataset $(ANY_SOLID) --runs $(OUT)/pretrained \
		--publish $(PUBLISHED)/pretrained $(addprefix --epochs ,$(EPOCHS))
	$(PY) $(MANIFEST) add $(PUBLISHED)/pretrained

.PRECIOUS: $(ANY_SOLID)
$(ANY_SOLID): bem/solver/version.py | $(INSTALLED)
	@mkdir -p $(@D)
	$(VENV)/bin/bem campaign --design sobol --count 65536 --modulus-ratio 0.01:1 --steps physical --replace --out $@
	@touch $@

# The protocols of the data set at physical measurement steps; not published.
PHYSICAL := $(OUT)/dataset/physical.h5
.PRECIOUS: $(PHYSICAL)
$(PHYSICAL): bem/solver/version.py | $(INSTALLED)
	@mkdir -p $(@D)
	$(VENV)/bin/bem campaign --design paper --count $(COUNT) --seed 0 --accuracy standard --steps physical --replace --out $@
	@touch $@

feature-sets.publishes := feature_sets  ## Train the input representations A to F, some of them also at physical steps, and publish their errors
feature-sets.with := --physical $(PHYSICAL)
data-efficiency.publishes := data_efficiency  ## Train on decreasing shares of the data and publish the errors
.PHONY: feature-sets data-efficiency
feature-sets: $(PHYSICAL)
feature-sets data-efficiency: $(DATASET) | $(INSTALLED)
	$(PY) -m experiments $(call value_of,$@.publishes) --config $(CONFIGS)/$(call value_of,$@.publishes).toml --dataset $(DATASET) --models $(MODELS) \
		--work $(WORK)/$(call value_of,$@.publishes) --out $(PUBLISHED)/$(call value_of,$@.publishes).json $($@.with) \
		$(call list_also_unfinished,$(PUBLISHED)/$(call value_of,$@.publishes).json)

fill-reproducibility = [ $(PUBLISHED) != published ] || $(PY) tools/fill.py docs/reproducibility.md

ranking.publishes := ranking  ## Rank the models by every published seed, with intervals, and publish it (seconds)
.PHONY: ranking
ranking: $(DATASET) | $(INSTALLED)
	$(PY) -m experiments ranking $(PLACES)
	$(PY) $(MANIFEST) add $(path.ranking)
	$(fill-reproducibility)

model-forces.publishes := model_forces  ## Publish which models were trained on the forces of the published data set
.PHONY: model-forces
model-forces: $(DATASET) | $(INSTALLED)
	$(PY) -m experiments model_forces $(PLACES)
	$(PY) $(MANIFEST) add $(path.model_forces)
	$(fill-reproducibility)

.PHONY: seed-commands
seed-commands: $(DATASET) | $(INSTALLED)  ## Print the commands that train the missing seeds of the models and of the inputs A to D
	@$(PY) -m experiments seed_commands $(PLACES)

.PHONY: median-seeds
median-seeds: $(DATASET) | $(INSTALLED)  ## Replace each model by the median of its three seeds
	$(PY) -m experiments median_seeds $(PLACES)
	$(PY) $(MANIFEST) add $(MODELS)
	$(MAKE) --no-print-directory model-forces cards

.PHONY: cards
cards: setup  ## Write the cards of the data set and of each published model, and the metadata
	$(PY) -m paper_figures.report.cards --published $(PUBLISHED)
	$(PY) $(MANIFEST) add $(PUBLISHED)/dataset.croissant.json $(PUBLISHED)/models $(PUBLISHED)/pretrained

HOURS ?= --hours
STAGES := dataset models more-models feature-sets data-efficiency
.PHONY: from-scratch
from-scratch:
	+@for stage in $(STAGES) paper; do \
		$(PY) -m experiments.stages $$stage $(HOURS); \
		[ $$stage != paper ] || [ -f $(MEASUREMENTS)/canonical_times.json ] || \
			$(MAKE) --no-print-directory measure-canonical-times BUSY=yes; \
		$(MAKE) --no-print-directory $$stage; \
	done

SCRATCH := results/scratch
.PHONY: paper-from-scratch
paper-from-scratch: setup  ## Compute everything into results/scratch without published files; prints the expected hours, resumes
	@$(PY) -m experiments.stages
	@mkdir -p $(SCRATCH)
	+$(MAKE) --no-print-directory from-scratch OUT=$(SCRATCH) PUBLISHED=$(SCRATCH)/published REPORT=$(SCRATCH)/REPRODUCTION.md

SMOKE ?= results/smoke
.PHONY: smoke
smoke: setup  ## The same steps on tiny data with one epoch, in minutes; the numbers have no meaning
	@mkdir -p $(SMOKE)
	+$(MAKE) --no-print-directory from-scratch OUT=$(SMOKE) PUBLISHED=$(SMOKE)/published REPORT=$(SMOKE)/REPRODUCTION.md \
		HOURS=--no-hours CONFIGS=experiments/configs/smoke COUNT=120 EPOCHS=1 ONLY="M1-concat M4-FiLM" \
		MORE_MODELS=model-large EXTRA=40

##@ Measurements (long, or specific to a machine; need an idle machine; published)

PROTOCOLS ?= 200
FINEST ?= 200
FINEST_PEER ?= 128
SAMPLES ?= 1000000
SOLVER_SAMPLES ?= 4000
SOAK ?= 100000
SOAK_BEYOND ?= 20000
# BUSY=yes publishes times even if the machine was busy.
BUSY ?=
# KEEP=yes keeps the trainings of the last measurement of size against error.
KEEP ?=
IDLE := $(if $(BUSY),--busy)
SPEED := --speed $(MEASUREMENTS)/training_speed.json
DATA := --dataset $(DATASET)
ALL_MODELS := --models $(MODELS)

.PHONY: measurements
measurements: $$(filter-out soak measure-peers measure-size-error,$$(MEASURING))  ## All measurements except the soak, trainings and those of other software
# Two simultaneous measurements would disturb each other.
.NOTPARALLEL: measurements

# TARGET.makes := RESULT. TARGET.runs is its module, if its name differs; .with are its options, .needs its inputs.
measure-effects.makes := effects  ## Seconds and errors of scenes that add one effect at a time
measure-effects.runs := measure
measure-effects.with := $(IDLE)
measure-recommendations.makes := recommendations  ## How often `recommend` meets its tolerance, and what it saves
measure-recommendations.with := $(IDLE)
measure-canonical-times.makes := canonical_times  ## Seconds of solver and surrogate on the twelve canonical protocols
measure-canonical-times.with := --config $(CONFIGS)/canonical_times.toml $(ALL_MODELS) $(IDLE)
measure-canonical-times.needs := M1-concat
measure-accuracy-cost.makes := accuracy_cost  ## Seconds against errors of every tool (PROTOCOLS=200; FINEST=200 nodes of the paper's discretisation at most)
measure-accuracy-cost.with := --count $(PROTOCOLS) --finest $(FINEST) $(DATA) $(ALL_MODELS) $(IDLE)
measure-accuracy-cost.needs := dataset
measure-cost-growth.makes := cost_growth  ## Growth of the cost with nodes, steps and the scene
measure-cost-growth.with := $(DATA) $(IDLE)
measure-cost-growth.needs := dataset
measure-amortisation.makes := amortisation  ## When a surrogate pays for itself; uses the measurement of accuracy and cost
measure-amortisation.with := --cost $(MEASUREMENTS)/accuracy_cost.json $(DATA) $(ALL_MODELS) $(SPEED)
measure-amortisation.needs := dataset accuracy_cost
measure-peers.makes := peers  ## The same elastic sphere in Adhesion and tamaas (FINEST_PEER=128 points a side)
measure-peers.with := --finest $(FINEST_PEER) $(IDLE)
bench-campaign.makes := campaign_scale  ## Cost of a campaign besides its trajectories: two processes, Dask, storage
bench-campaign.runs := bench_campaign
bench-campaign.with := $(DATA) $(IDLE)
bench-campaign.needs := dataset
measure-training-cost.makes := training_cost  ## Error against time of training, from the published models
measure-training-cost.with := $(DATA) $(ALL_MODELS) --shares $(PUBLISHED)/data_efficiency.json $(SPEED)
measure-training-cost.needs := dataset
measure-hard-cases.makes := hard_case_map  ## The solver over the box, beyond it and at named extremes, with refinement
measure-floor.makes := measurement_floor  ## Errors of the measurement steps alone, uniform and physical
measure-step-length.makes := step_length  ## How well the inputs A to E show the length of a measurement step
measure-step-length.with := $(DATA)
measure-step-length.needs := dataset
measure-surrogates.makes := pretrained_errors  ## Errors, bands and cost of the pretrained models on hidden protocols
measure-surrogates.needs := M1-concat
measure-inverse.makes := inverse_problem  ## The posterior of a material from a noisy curve: 10^6 samples of `fast`, SOLVER_SAMPLES=4000 of the solver (SAMPLES=1000000)
measure-inverse.with := --samples $(SAMPLES) --solver-samples $(SOLVER_SAMPLES) $(IDLE)
measure-size-error.makes := size_error  ## Train LSTMs of 8 to 256 units as `fast` and compare them with the paper's models (half an hour; resumes; KEEP=yes keeps the LSTMs)
measure-size-error.with := --dataset $(ANY_SOLID) --runs $(OUT)/size_error $(ALL_MODELS) $(if $(KEEP),--keep-lstms)
measure-size-error.needs := $(if $(KEEP),,any_solid)
measure-broad-band.makes := broad_band  ## Pull-off of broad-band solids over the unloading rate
measure-broad-band.beside := broad_band.csv
measure-large-tabor.makes := large_tabor  ## Pull-off, a viscoelastic crack and their cost at large Tabor parameters
measure-surrogate-map.makes := surrogate_map  ## Errors of M1-concat over the box, in its worst trajectories, and out of range
measure-surrogate-map.with := --model M1-concat $(DATA) $(ALL_MODELS)
measure-surrogate-map.needs := dataset
measure-fit-coverage.makes := lab_coverage  ## How often 95 % intervals of fitted force curves contain the truth; continues after an interruption
bench-training.makes := training_speed  ## Cost of a training batch of each of the 18 paper models
bench-training.with := $(DATA) $(IDLE)
bench-training.needs := dataset
bench-surrogate.makes := surrogate_latency  ## Cost of a prediction, compared with Keras's model.predict
bench-surrogate.runs := bench_surrogate
bench-surrogate.with := $(ALL_MODELS) $(IDLE)
bench-stream.makes := stream_latency  ## The latency of a million steps of a stream
bench-stream.runs := bench_surrogate
bench-stream.with := --stream $(ALL_MODELS) $(IDLE)
measure-streaming.makes := streaming_cost  ## Microseconds of a step of a stream and of a stateful session of ONNX Runtime
measure-streaming.with := $(ALL_MODELS) $(IDLE)
measure-streaming.needs := M1-concat
bench-targets.makes := target_minutes  ## Minutes of each target of REPRODUCING.md (TARGETS="figure-1 ..." selects some)
bench-targets.with := $(addprefix --only ,$(TARGETS))
soak.makes := soak  ## Run SOAK=100000 random protocols in the box and SOAK_BEYOND=20000 beyond it; resumes
soak.with := --count $(SOAK) --beyond $(SOAK_BEYOND)

.PHONY: bench-startup
bench-startup: setup  ## Processor seconds of a first and of a warm run of bem simulate (BASELINE=REVISION adds a revision)
	$(PY) -m experiments startup $(addprefix --baseline ,$(BASELINE))

.PHONY: bench-solver
bench-solver: setup  ## Write errors and cost of the solver into docs/solver-benchmark.md (BASELINE=REVISION compares instead)
	$(PY) -m experiments bench_solver $(addprefix --baseline ,$(BASELINE))

.PHONY: table-solver-hard-cases
table-solver-hard-cases: setup  ## Run the solver in the most difficult cases (long); writes docs/solver-hard-cases.md
	$(PY) -m experiments hard_cases

##@ Development

.PHONY: test
test: check-lock lint  ## Everything continuous integration runs: lock, lint, format, types, fast tests
	$(PY) -m pytest -n $(TEST_WORKERS) --dist loadfile

.PHONY: test-slow
test-slow: setup  ## Run the long tests
	$(PY) -m pytest -n $(TEST_WORKERS) -m slow

.PHONY: golden-trajectories
golden-trajectories: setup  ## Update the trajectories that guard the solver's results, after its version was raised
	$(PY) -m experiments golden_trajectories

.PHONY: lint
lint: setup  ## Check style, and the types of the public interface
	$(PY) -m ruff check .
	$(PY) -m ruff format --check .
	$(PY) -m mypy

.PHONY: format
format: setup  ## Format the code
	$(PY) -m ruff check --fix .
	$(PY) -m ruff format .

.PHONY: check-lock
check-lock: setup  ## Fail if requirements.lock does not match pyproject.toml
	$(PY) tools/lock.py check

.PHONY: lock
lock:  ## Resolve pyproject.toml again into requirements.lock (needs the network)
	@[ -x $(VENV)/bin/uv ] || { echo "uv not found in $(VENV); run \`make setup\` first" >&2; exit 1; }
	$(VENV)/bin/uv pip compile --quiet --universal --python-version 3.11 \
		--extra train --extra cluster --extra lab --extra tables --extra dev --generate-hashes \
		--no-emit-index-url --no-header --output-file requirements.lock pyproject.toml
	$(PY) tools/lock.py stamp

.PHONY: clean
clean:  ## Remove caches and build files; never results/, published/ or .venv
	rm -rf build dist *.egg-info .mypy_cache .pytest_cache .ruff_cache .hypothesis
	find . -path ./$(VENV) -prune -o -path ./results -prune -o -path ./published -prune \
		-o -type d -name __pycache__ -exec rm -rf {} +

##@ Documentation and demonstrator

# Pages of the tutorials are kept until a tutorial or the solver changes.
TUTORIALS := docs/gallery/.solver
$(TUTORIALS): bem/solver/version.py
	rm -rf $(@D)
	mkdir -p $(@D)
	touch $@

.PHONY: docs
docs: setup $(TUTORIALS)  ## Build the documentation into build/site, with its tutorials (4 minutes the first time); a broken link fails
	@$(PY) -m bem compile > /dev/null  # so that no tutorial shows that it compiles
	OMP_NUM_THREADS=1 NO_MKDOCS_2_WARNING=1 $(PY) -m mkdocs build --strict --quiet

.PHONY: readme-pictures
readme-pictures: setup $(FIGURES)/graphical-abstract.pdf  ## Update the pictures of the README, with its own commands
	@for program in bem surrogate; do \
		command="$$(grep "^$(VENV)/bin/$$program .*--plot" README.md)"; set -x; $${command/--plot /--plot docs/images/}; { set +x; } 2>/dev/null; \
	done
	cp $(FIGURES)/graphical-abstract.png docs/images/

.PHONY: docs-effects
docs-effects: figure-effects  ## Update the picture of docs/effects.md
	cp $(FIGURES)/figure-effects.png docs/images/

.PHONY: docs-cost
docs-cost: $(addprefix $(MEASUREMENTS)/,accuracy_cost.json peers.json campaign_scale.json) | $(INSTALLED)  ## Update the tables of docs/cost.md and docs/cluster.md
	$(PY) tools/fill.py docs/cost.md docs/cluster.md --published $(PUBLISHED)

.PHONY: docs-control
docs-control: setup  ## Update the times of a prediction and of a step in docs/control.md and docs/network.md
	$(PY) tools/fill.py docs/control.md docs/network.md --published $(PUBLISHED)

.PHONY: docs-laboratory
docs-laboratory: $(MEASUREMENTS)/lab_coverage.json | $(INSTALLED)  ## Renew the table of docs/laboratory.md
	$(PY) tools/fill.py docs/laboratory.md --published $(PUBLISHED)

.PHONY: docs-surrogates
docs-surrogates: $(addprefix $(MEASUREMENTS)/,pretrained_errors.json inverse_problem.json size_error.json) | $(INSTALLED)  ## Renew the tables of docs/surrogate-models.md
	$(PY) tools/fill.py docs/surrogate-models.md --published $(PUBLISHED)

DEMO_MODEL ?= published/models/M1-concat/model.onnx
DEMO_PORT ?= 8000

.PHONY: demo-build
demo-build: demo/node_modules/.installed  ## Build the browser demonstrator into demo/dist (Node 18 or newer; DEMO_MODEL=... chooses the ONNX file)
	node demo/build.mjs $(DEMO_MODEL)

.PHONY: demo
demo: demo-build  ## Build the demonstrator and serve it at http://localhost:8000 (DEMO_PORT=... chooses the port)
	@python3 tools/serve.py demo/dist --port $(DEMO_PORT)

.PHONY: test-demo
test-demo: setup  ## Test the demonstrator in headless Chromium against Python; installs missing Debian packages
	tests/demo/run.sh $(DEMO_MODEL)

.PHONY: demo-curves
demo-curves: setup  ## Choose and simulate the solver curves of the demonstrator (demo/public/curves.json and solids.json)
	$(PY) -m experiments.demo_curves

.PHONY: demo-models
demo-models: setup  ## Export the pretrained models for the demonstrator (demo/public/fast.onnx and accurate.onnx)
	for model in fast accurate; do $(PY) -m surrogate export $$model --models $(PUBLISHED)/pretrained --out demo/public/$$model.onnx || exit 1; done

demo/node_modules/.installed: demo/package.json demo/package-lock.json demo/.npmrc
	@command -v npm >/dev/null || { echo "npm not found; install Node 18 or newer with npm" >&2; exit 1; }
	cd demo && npm ci --silent
	@touch $@

##@ More

.PHONY: help help-all
help:  ## List the targets that use published results, and the names of the others
	@awk -f tools/help.awk Makefile
help-all:  ## List every target
	@awk -v all=1 -f tools/help.awk Makefile

# Rules for the lines above.

# A value, without the spaces before its caption.
value_of = $(strip $($(1)))
named = $(sort $(patsubst %.$(1),%,$(filter %.$(1),$(.VARIABLES))))
PAPER := $(call named,paper)
COST := $(call named,cost)
SHOWN := $(PAPER) $(COST)
MEASURING := $(call named,makes)
STUDY_RESULTS := $(patsubst %,$(STUDIES)/%.json,$(call named,study))
path.dataset := $(DATASET)
# The folder and its files: the folder changes if an entry is removed, which a wildcard does not show.
path.models = $(MODELS) $(wildcard $(MODELS)/*/run.json)
path.M1-concat = $(addprefix $(REFERENCE)/,run.json model.weights.h5 scaling.json) $(wildcard $(REFERENCE)/model.onnx)
path.more-models = $(path.models)
path.any_solid := $(ANY_SOLID)
path.solver := bem/solver/version.py
path.architectures := surrogate/architectures/registry.py
path.feature_sets := $(PUBLISHED)/feature_sets.json
path.data_efficiency := $(PUBLISHED)/data_efficiency.json
path.accuracy_price := $(PUBLISHED)/accuracy_price.json
path.ranking := $(PUBLISHED)/ranking.json
path.model_forces := $(PUBLISHED)/model_forces.json
path = $(or $(path.$(1)),$(filter $(STUDIES)/$(1).json,$(STUDY_RESULTS)),$(MEASUREMENTS)/$(1).json)
inputs = $(foreach one,$(1),$(if $(filter %?,$(one)),$(wildcard $(call path,$(one:?=))),$(call path,$(one))))
LEFT_OUT := $(if $(wildcard $(addprefix $(MODELS)/M[1-6]-,FiLM/run.json gated/run.json)),,figure-learning-curves) \
	$(if $(wildcard $(path.feature_sets) $(path.data_efficiency)),,figure-features) \
	$(if $(wildcard $(path.accuracy_price)),,table-accuracy-price) $(if $(wildcard $(path.ranking)),,figure-ranking table-ranking)

# Without this, make would find a figure that exists up to date with inputs that do not.
READING := $(SHOWN) table-hard-cases cost-figures figures tables paper report studies
$(if $(filter $(READING),$(MAKECMDGOALS)),$(if $(wildcard $(PUBLISHED)/.),,$(error \
	PUBLISHED must be a folder that exists; received '$(PUBLISHED)')))

# `make setup-small` installs no Keras, from whose models these are drawn.
WITHOUT_KERAS := $(if $(SMALL),figure-4 figure-architectures)
LEFT_OUT += $(WITHOUT_KERAS)
$(if $(filter setup,$(MAKECMDGOALS)),,$(foreach goal,$(if $(SMALL),$(filter $(WITHOUT_KERAS) report paper studies,$(MAKECMDGOALS))),$(error \
	$(goal) needs Keras, which this small installation leaves out; run `make setup` first)))

# The file of a figure or table, and the figure or table of a file.
product = $(if $(filter table-%,$(1)),$(TABLES)/$(1:table-%=%).md,$(FIGURES)$($(1).under)/$(1).pdf)
shown = $(if $(filter %.md,$(1)),table-)$(basename $(notdir $(1)))
depends = $(foreach one,$(1),$(dir $(one)).depends/$(basename $(notdir $(one))).d)
FILES := $(foreach one,$(SHOWN),$(call product,$(one)))
DEPENDS := $(call depends,$(FILES) $(STUDY_RESULTS))

.PHONY: $(SHOWN) $(MEASURING)
$(SHOWN): %: $$(call product,$$*)

$(FILES): $$(call inputs,$$($$(call shown,$$@).paper) $$($$(call shown,$$@).cost)) $$(call depends,$$@) | $(INSTALLED)
	$(PY) -m paper_figures $(call shown,$@) $(PLACES) $($(call shown,$@).with) --depends $@

$(STUDY_RESULTS): $(STUDIES)/%.json: $$(call inputs,$$($$*.study)) $$(call depends,$$@) | $(INSTALLED)
	$(PY) -m experiments --depends $@ $* $(PLACES) --configs $(CONFIGS)

# A result without such a record is made again; with one, it is made again if a recorded file has changed.
$(DEPENDS): ;
include $(wildcard $(DEPENDS))

# BLAS and the backends of the surrogates must use one core only.
$(MEASURING): export OMP_NUM_THREADS := 1
$(MEASURING): %: $$(call inputs,$$($$*.needs)) | $(INSTALLED)
	$(PY) -m experiments $(or $($*.runs),$(call value_of,$*.makes)) $($*.with) --out $(MEASUREMENTS)/$(call value_of,$*.makes).json
	$(PY) $(MANIFEST) add $(MEASUREMENTS)/$(call value_of,$*.makes).json
	$(if $($*.beside),$(PY) $(MANIFEST) add $(MEASUREMENTS)/$($*.beside) --command "python -m experiments $(call value_of,$*.makes)")

# The message about a missing file names the target that makes it.
maker = $(strip $(foreach one,$(MEASURING),$(if $(filter $(1),$($(one).makes)),$(one))))
missing = echo "$@ is missing; restore it from the repository, or run \`make $(1)\`" >&2; exit 1
$(MEASUREMENTS)/%.json:
	@$(call missing,$(call maker,$*))
$(REFERENCE)/%:
	@$(call missing,models ONLY=M1-concat)
$(DATASET):
	@$(call missing,dataset)
$(path.accuracy_price):
	@$(call missing,accuracy-price)
