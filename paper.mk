# The paper, end to end: trainings, studies, every figure and table, the report. Included by the Makefile, whose two
# layers it keeps: a result file depends on its inputs, a figure on result files.

CONFIGS ?= experiments/configs
STUDIES := $(OUT)/studies
MODELS := $(PUBLISHED)/models
WORK := $(OUT)/training_studies
RECIPE ?= swift
JOBS ?= 2
# Models to train, all eighteen when empty, and epochs instead of the recipe's.
ONLY ?=
EPOCHS ?=

STUDY := experiments/common.py
STYLE := paper_figures/style/drawing.py paper_figures/style/paper.mplstyle
TRAINING_SPEED := $(PUBLISHED)/measurements/training_speed.json
CANONICAL_TIMES := $(PUBLISHED)/measurements/canonical_times.json
REFERENCE_MODEL := experiments/paper_values/reference_model.toml
SURROGATE := $(wildcard surrogate/*.py surrogate/*/*.py)
# What a prediction and its errors depend on; nothing that only trains.
TRAINING_ONLY := surrogate/__main__.py $(wildcard surrogate/cli/*.py surrogate/training/*.py)
PREDICTING := $(filter-out $(TRAINING_ONLY),$(SURROGATE))
REFERENCE := $(MODELS)/M1-concat
LINEAGE := experiments/lineage.py surrogate/training/identity.py surrogate/data/dataset.py
# What tells where a model comes from.
ORIGIN := run.json split.json recipe.toml
# What a study of the reference model reads; the rule below says how it comes about when it is missing.
REFERENCE_FILES := $(REFERENCE)/run.json $(REFERENCE)/model.weights.h5 $(REFERENCE)/scaling.json \
	$(wildcard $(REFERENCE)/model.onnx) $(PREDICTING)
FEATURE_SETS := $(PUBLISHED)/feature_sets.json
DATA_EFFICIENCY := $(PUBLISHED)/data_efficiency.json

##@ Trainings (long; interrupted by Ctrl-C, continued by the same command)

# What was stopped has published what it trained until then.
list_also_unfinished = || status=$$?; [ ! -e $(1) ] || $(PY) $(MANIFEST) add $(1); exit $${status:-0}

.PHONY: models
models: $(DATASET) | $(INSTALLED)  ## Train and publish the models that are not published yet (hours)
	$(VENV)/bin/surrogate train-all --recipe $(RECIPE) --dataset $(DATASET) --jobs $(JOBS) --threads 1 \
		$(addprefix --only ,$(ONLY)) $(addprefix --epochs ,$(EPOCHS)) --runs $(OUT)/training --models $(MODELS) \
		$(call list_also_unfinished,$(MODELS))

# $(call beside,LABEL,OPTIONS) trains M1-concat otherwise than the eighteen, unless it is published.
define beside
	[ -f $(MODELS)/$(1)/run.json ] || $(VENV)/bin/surrogate train M1-concat --label $(1) $(2) --dataset $(DATASET) \
		--threads 1 --runs $(OUT)/training --models $(MODELS)
	$(PY) $(MANIFEST) add $(MODELS)/$(1)
endef

.PHONY: model-paper-recipe
model-paper-recipe: $(DATASET) | $(INSTALLED)  ## Train M1-concat by the paper's own recipe, as M1-concat-paper (hours)
	$(call beside,M1-concat-paper,--recipe paper $(addprefix --epochs ,$(EPOCHS)))

# The third input representation errs least of the four (`make feature-sets`).
.PHONY: model-inputs-c
model-inputs-c: $(DATASET) | $(INSTALLED)  ## Train M1-concat on the input representation C, as M1-concat-inputs-C
	$(call beside,M1-concat-inputs-C,--recipe swift --features C $(addprefix --epochs ,$(EPOCHS)))

# Nine times the trajectories more; the campaign's seed is another than the data set's. Not published.
EXTRA ?= $(shell echo $$((9 * $(COUNT))))
EXTRA_DATASET := $(OUT)/dataset/extra.h5

.PHONY: model-large
model-large: $(DATASET) | $(INSTALLED)  ## Train M1-concat on ten times the trajectories, from inputs C, as M1-concat-large (simulates them first)
	[ -f $(MODELS)/M1-concat-large/run.json ] || $(MAKE) --no-print-directory $(EXTRA_DATASET)
	$(call beside,M1-concat-large,--recipe swift --features C --extra $(EXTRA_DATASET) --epochs $(or $(EPOCHS),5))

.PRECIOUS: $(EXTRA_DATASET)
$(EXTRA_DATASET): $(SOLVER) | $(INSTALLED)
	$(VENV)/bin/bem campaign --design paper --seed 1 --count $(EXTRA) --accuracy standard --replace --out $@
	@touch $@

.PHONY: model-budgets
model-budgets: $(DATASET) | $(INSTALLED)  ## Train M1-concat for 8, 15 and 60 epochs, for the error against core-minutes
	$(call beside,M1-concat-8-epochs,--recipe swift --epochs $(or $(EPOCHS),8))
	$(call beside,M1-concat-15-epochs,--recipe swift --epochs $(or $(EPOCHS),15))
	$(call beside,M1-concat-60-epochs,--recipe swift --epochs $(or $(EPOCHS),60))

MORE_MODELS ?= model-paper-recipe model-budgets model-inputs-c model-large
.PHONY: more-models
more-models: $(MORE_MODELS)  ## The four above: M1-concat by another recipe, for shorter and longer, from other inputs, and on more data

.PHONY: feature-sets
feature-sets: $(DATASET) | $(INSTALLED)  ## Train the input representations A to D and publish their errors
	$(PY) -m experiments.paper.feature_sets --config $(CONFIGS)/feature_sets.toml --dataset $(DATASET) \
		--models $(MODELS) --work $(WORK)/feature_sets --out $(FEATURE_SETS) $(call list_also_unfinished,$(FEATURE_SETS))

.PHONY: data-efficiency
data-efficiency: $(DATASET) | $(INSTALLED)  ## Train on ever smaller shares of the data and publish the errors
	$(PY) -m experiments.paper.data_efficiency --config $(CONFIGS)/data_efficiency.toml --dataset $(DATASET) \
		--models $(MODELS) --work $(WORK)/data_efficiency --out $(DATA_EFFICIENCY) \
		$(call list_also_unfinished,$(DATA_EFFICIENCY))

$(REFERENCE)/%:
	@echo "$@ is missing; restore it from the repository, or run \`make models ONLY=M1-concat\`" >&2; exit 1

##@ Studies (short; result file <- data set and models)

.PHONY: studies
STUDY_RESULTS := $(addprefix $(STUDIES)/,canonical_regimes.json persson_brener.json error_statistics.json fms_transfer.json \
	model_comparison.json architecture_graphs.json adopted_settings.json paper_slips.json)
studies: $(STUDY_RESULTS)  ## Every study that trains nothing

$(STUDIES)/canonical_regimes.json: experiments/paper/canonical_regimes.py $(STUDY) $(CONFIGS)/canonical_regimes.toml \
		experiments/paper_values/canonical_protocols.csv $(CANONICAL_TIMES) $(SOLVER) $(REFERENCE_FILES) | $(INSTALLED)
	$(PY) -m experiments.paper.canonical_regimes --config $(CONFIGS)/canonical_regimes.toml --models $(MODELS) \
		--times $(CANONICAL_TIMES) --out $@

$(STUDIES)/persson_brener.json: experiments/paper/persson_brener.py $(STUDY) $(CONFIGS)/persson_brener.toml \
		experiments/paper_values/persson_brener_protocols.csv bem/reference_solutions/persson_brener.py $(SOLVER) \
		$(REFERENCE_FILES) | $(INSTALLED)
	$(PY) -m experiments.paper.persson_brener --config $(CONFIGS)/persson_brener.toml --models $(MODELS) --out $@

$(STUDIES)/error_statistics.json: experiments/paper/error_statistics.py $(STUDY) $(LINEAGE) $(CONFIGS)/error_statistics.toml \
		$(addprefix $(REFERENCE)/,test_errors.csv $(ORIGIN)) $(DATASET) | $(INSTALLED)
	$(PY) -m experiments.paper.error_statistics --config $(CONFIGS)/error_statistics.toml --models $(MODELS) \
		--dataset $(DATASET) --out $@

$(STUDIES)/fms_transfer.json: experiments/paper/fms_transfer.py $(STUDY) $(LINEAGE) $(CONFIGS)/fms_transfer.toml $(SOLVER) \
		experiments/paper_values/canonical_protocols.csv $(addprefix $(REFERENCE)/,$(ORIGIN)) $(DATASET) \
		$(REFERENCE_FILES) | $(INSTALLED)
	$(PY) -m experiments.paper.fms_transfer --config $(CONFIGS)/fms_transfer.toml --models $(MODELS) --dataset $(DATASET) --out $@

# Here and below a published folder is a prerequisite beside what is in it: it changes when an entry goes, of which a
# wildcard does not tell.
$(STUDIES)/model_comparison.json: experiments/paper/model_comparison.py $(STUDY) $(LINEAGE) $(REFERENCE)/run.json \
		$(wildcard $(addprefix $(MODELS)/*/,metrics.json history.csv $(ORIGIN)) $(MODELS)) \
		surrogate/architectures/naming.py $(REFERENCE_MODEL) $(DATASET) | $(INSTALLED)
	$(PY) -m experiments.paper.model_comparison --models $(MODELS) --dataset $(DATASET) --out $@

$(STUDIES)/architecture_graphs.json: experiments/paper/architecture_graphs.py $(STUDY) $(SURROGATE) | $(INSTALLED)
	$(PY) -m experiments.paper.architecture_graphs --out $@

$(STUDIES)/adopted_settings.json: experiments/paper/adopted_settings.py $(STUDY) $(SURROGATE) $(wildcard surrogate/training/recipes/*.toml) \
		$(wildcard $(CONFIGS)/*.toml) experiments/paper_values/persson_brener_protocols.csv $(addprefix bem/,dataset/designs.py \
		dataset/measurement_steps.py protocol.py $(addprefix reference_solutions/,dmt.py jkr.py persson_brener.py)) | $(INSTALLED)
	$(PY) -m experiments.paper.adopted_settings --configs $(CONFIGS) --out $@

$(STUDIES)/paper_slips.json: experiments/paper/inconsistencies.py $(STUDY) $(SOLVER) $(DATASET) \
		$(wildcard experiments/paper_values/*.csv) experiments/paper_values/claims.toml $(REFERENCE_MODEL) | $(INSTALLED)
	$(PY) -m experiments.paper.inconsistencies --dataset $(DATASET) --out $@

##@ The paper's figures and tables (figure <- result file)

.PHONY: figure-1
figure-1: $(FIGURES)/figure-1.pdf  ## Contact, gap, protocol and a computed force response
$(FIGURES)/figure-1.pdf: paper_figures/figures/figure_1.py paper_figures/style/schematics.py $(OUT)/dataset/examples.json $(STYLE) | $(INSTALLED)
	$(PY) -m paper_figures.figures.figure_1 --examples $(OUT)/dataset/examples.json --folder $(FIGURES)

.PHONY: figure-4
figure-4: $(FIGURES)/figure-4.pdf  ## Building blocks and the M1-concat model
$(FIGURES)/figure-4.pdf: paper_figures/figures/figure_4.py paper_figures/style/schematics.py $(STUDIES)/architecture_graphs.json $(STYLE) | $(INSTALLED)
	$(PY) -m paper_figures.figures.figure_4 --result $(STUDIES)/architecture_graphs.json --folder $(FIGURES)

.PHONY: figure-5
figure-5: $(FIGURES)/figure-5.pdf  ## Models, sizes, crack velocity, data efficiency
$(FIGURES)/figure-5.pdf: paper_figures/figures/figure_5.py paper_figures/style/models_style.py paper_figures/figures/figure_mse_mae.py \
		paper_figures/figures/figure_learning_curves.py $(REFERENCE_MODEL) $(STUDIES)/model_comparison.json $(STUDIES)/persson_brener.json \
		$(wildcard $(DATA_EFFICIENCY) $(PUBLISHED)) $(STYLE) | $(INSTALLED)
	$(PY) -m paper_figures.figures.figure_5 --comparison $(STUDIES)/model_comparison.json --persson-brener $(STUDIES)/persson_brener.json \
		--data-efficiency $(DATA_EFFICIENCY) --folder $(FIGURES)

.PHONY: figure-6
figure-6: $(FIGURES)/figure-6.pdf  ## The twelve canonical protocols
$(FIGURES)/figure-6.pdf: paper_figures/figures/figure_6.py paper_figures/style/models_style.py $(STUDIES)/canonical_regimes.json $(STYLE) | $(INSTALLED)
	$(PY) -m paper_figures.figures.figure_6 --result $(STUDIES)/canonical_regimes.json --folder $(FIGURES)

.PHONY: figure-7
figure-7: $(FIGURES)/figure-7.pdf  ## Distributions of the held-out errors
$(FIGURES)/figure-7.pdf: paper_figures/figures/figure_7.py $(STUDIES)/error_statistics.json $(STYLE) | $(INSTALLED)
	$(PY) -m paper_figures.figures.figure_7 --result $(STUDIES)/error_statistics.json --folder $(FIGURES)

.PHONY: figure-architectures
figure-architectures: $(FIGURES)/figure-architectures.pdf  ## The eighteen wirings, from the Keras models
$(FIGURES)/figure-architectures.pdf: paper_figures/figures/figure_architectures.py $(STUDIES)/architecture_graphs.json $(STYLE) | $(INSTALLED)
	$(PY) -m paper_figures.figures.figure_architectures --result $(STUDIES)/architecture_graphs.json --folder $(FIGURES)

.PHONY: figure-mse-mae
figure-mse-mae: $(FIGURES)/figure-mse-mae.pdf  ## Held-out MSE against MAE of every trained model
$(FIGURES)/figure-mse-mae.pdf: paper_figures/figures/figure_mse_mae.py paper_figures/style/models_style.py $(REFERENCE_MODEL) $(STUDIES)/model_comparison.json $(STYLE) | $(INSTALLED)
	$(PY) -m paper_figures.figures.figure_mse_mae --result $(STUDIES)/model_comparison.json --folder $(FIGURES)

.PHONY: figure-learning-curves
figure-learning-curves: $(FIGURES)/figure-learning-curves.pdf  ## Validation curves of the FiLM and gated models
$(FIGURES)/figure-learning-curves.pdf: paper_figures/figures/figure_learning_curves.py paper_figures/style/models_style.py \
		$(STUDIES)/model_comparison.json $(STYLE) | $(INSTALLED)
	$(PY) -m paper_figures.figures.figure_learning_curves --result $(STUDIES)/model_comparison.json --folder $(FIGURES)

.PHONY: figure-features
figure-features: $(FIGURES)/figure-features.pdf  ## Input representations and training-set size
$(FIGURES)/figure-features.pdf: paper_figures/figures/figure_features.py $(wildcard $(FEATURE_SETS) $(DATA_EFFICIENCY) $(PUBLISHED)) \
		$(STYLE) | $(INSTALLED)
	$(PY) -m paper_figures.figures.figure_features --feature-sets $(FEATURE_SETS) --data-efficiency $(DATA_EFFICIENCY) --folder $(FIGURES)

.PHONY: figure-fms-transfer
figure-fms-transfer: $(FIGURES)/figure-fms-transfer.pdf  ## The same weights on other numbers of measurement steps
$(FIGURES)/figure-fms-transfer.pdf: paper_figures/figures/figure_fms_transfer.py paper_figures/style/models_style.py $(STUDIES)/fms_transfer.json $(STYLE) | $(INSTALLED)
	$(PY) -m paper_figures.figures.figure_fms_transfer --result $(STUDIES)/fms_transfer.json --folder $(FIGURES)

.PHONY: graphical-abstract
graphical-abstract: $(FIGURES)/graphical-abstract.pdf  ## Protocol in, force history out
$(FIGURES)/graphical-abstract.pdf: paper_figures/figures/graphical_abstract.py paper_figures/style/schematics.py paper_figures/style/models_style.py \
		$(STUDIES)/canonical_regimes.json $(STUDIES)/error_statistics.json $(STYLE) | $(INSTALLED)
	$(PY) -m paper_figures.figures.graphical_abstract --regimes $(STUDIES)/canonical_regimes.json \
		--errors $(STUDIES)/error_statistics.json --folder $(FIGURES)

.PHONY: table-protocols-canonical
table-protocols-canonical: $(TABLES)/protocols-canonical.md  ## Canonical protocols and what they cost
$(TABLES)/protocols-canonical.md: paper_figures/tables/table_protocols_canonical.py $(STUDIES)/canonical_regimes.json $(STYLE) paper_figures/style/writing.py | $(INSTALLED)
	$(PY) -m paper_figures.tables.table_protocols_canonical --result $(STUDIES)/canonical_regimes.json --folder $(TABLES)

.PHONY: table-persson-brener
table-persson-brener: $(TABLES)/persson-brener.md  ## Crack velocities and amplifications
$(TABLES)/persson-brener.md: paper_figures/tables/table_persson_brener.py $(STUDIES)/persson_brener.json $(STYLE) paper_figures/style/writing.py | $(INSTALLED)
	$(PY) -m paper_figures.tables.table_persson_brener --result $(STUDIES)/persson_brener.json --folder $(TABLES)

.PHONY: table-quartiles
table-quartiles: $(TABLES)/quartiles.md  ## Held-out errors by quartile
$(TABLES)/quartiles.md: paper_figures/tables/table_quartiles.py experiments/paper_values/quartiles.csv $(STUDIES)/error_statistics.json $(STYLE) paper_figures/style/writing.py | $(INSTALLED)
	$(PY) -m paper_figures.tables.table_quartiles --result $(STUDIES)/error_statistics.json --folder $(TABLES)

.PHONY: table-models
table-models: $(TABLES)/models.md  ## Every trained model: size, errors, cost
$(TABLES)/models.md: paper_figures/tables/table_models.py paper_figures/style/models_style.py $(REFERENCE_MODEL) $(STUDIES)/model_comparison.json \
		$(wildcard $(TRAINING_SPEED) $(PUBLISHED)/measurements) $(STYLE) paper_figures/style/writing.py | $(INSTALLED)
	$(PY) -m paper_figures.tables.table_models --result $(STUDIES)/model_comparison.json --folder $(TABLES) --speed $(TRAINING_SPEED)

##@ All of it

# A figure whose every input is still untrained is left out with a word instead of failing the rest.
TRAINED_OTHERS := $(wildcard $(addprefix $(MODELS)/M[1-6]-,FiLM/run.json gated/run.json))
CURVES := $(if $(TRAINED_OTHERS),figure-learning-curves)
FEATURES := $(if $(wildcard $(FEATURE_SETS) $(DATA_EFFICIENCY)),figure-features)

ALL_FIGURES := figure-1 figure-2 figure-3 figure-4 figure-5 figure-6 figure-7 figure-architectures figure-mse-mae \
	figure-fms-transfer graphical-abstract $(CURVES) $(FEATURES)
.PHONY: figures
figures: $(ALL_FIGURES)  ## Every figure whose inputs are published
	@$(if $(CURVES),,echo "figure-learning-curves is left out: no FiLM or gated model is published; \`make models\` trains them")
	@$(if $(FEATURES),,echo "figure-features is left out: \`make feature-sets data-efficiency\` trains what it shows")
	@echo "figures are in $(FIGURES)"

.PHONY: tables
tables: table-protocols-dataset table-protocols-canonical table-quartiles table-persson-brener table-models $(if $(wildcard $(ACCURACY_PRICE)),table-accuracy-price)  ## Every table
	@echo "tables are in $(TABLES)"

REPORT ?= REPRODUCTION.md
# Its hours and minutes are of what is published.
REPRODUCING ?= $(if $(filter published,$(PUBLISHED)),REPRODUCING.md)
.PHONY: report
report: $(STUDY_RESULTS) $(OUT)/dataset/statistics.json | $(INSTALLED)  ## Write REPRODUCTION.md: each number of the paper beside ours
	$(PY) -m paper_figures.report.write --results $(OUT) --published $(PUBLISHED) --out $(REPORT)
	$(if $(REPRODUCING),$(PY) -m experiments.stages --document $(REPRODUCING))

.PHONY: paper
paper: figures tables report  ## Figures, tables and the report, from what is published

HOURS ?= --hours
.PHONY: from-scratch
from-scratch:
	@$(PY) -m experiments.stages dataset $(HOURS)
	+$(MAKE) --no-print-directory dataset
	@$(PY) -m experiments.stages models $(HOURS)
	+$(MAKE) --no-print-directory models
	@$(PY) -m experiments.stages more-models $(HOURS)
	+$(MAKE) --no-print-directory more-models
	@$(PY) -m experiments.stages feature-sets $(HOURS)
	+$(MAKE) --no-print-directory feature-sets
	@$(PY) -m experiments.stages data-efficiency $(HOURS)
	+$(MAKE) --no-print-directory data-efficiency
	@$(PY) -m experiments.stages paper $(HOURS)
	[ -f $(CANONICAL_TIMES) ] || $(MAKE) --no-print-directory measure-canonical-times BUSY=yes
	+$(MAKE) --no-print-directory paper

SCRATCH := results/scratch
.PHONY: paper-from-scratch
paper-from-scratch: setup  ## Everything anew into results/scratch, nothing published needed; prints its hours, resumes
	@$(PY) -m experiments.stages
	@mkdir -p $(SCRATCH)
	+$(MAKE) --no-print-directory from-scratch OUT=$(SCRATCH) PUBLISHED=$(SCRATCH)/published REPORT=$(SCRATCH)/REPRODUCTION.md

SMOKE ?= results/smoke
.PHONY: smoke
smoke: setup  ## The same path on tiny data and one epoch, in minutes; its numbers mean nothing
	@mkdir -p $(SMOKE)
	+$(MAKE) --no-print-directory from-scratch OUT=$(SMOKE) PUBLISHED=$(SMOKE)/published REPORT=$(SMOKE)/REPRODUCTION.md \
		HOURS=--no-hours CONFIGS=experiments/configs/smoke COUNT=120 EPOCHS=1 ONLY="M1-concat M4-FiLM" \
		MORE_MODELS=model-large EXTRA=40
