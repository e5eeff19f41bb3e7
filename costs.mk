# What accuracy costs, where the hard cases are, what each effect costs. Included by the Makefile, whose two layers it
# keeps. Measurements take long or belong to one machine, so that their results are published and figures redraw from
# them; `make measurements` is meant for an idle machine.

MEASUREMENTS := $(PUBLISHED)/measurements
PROTOCOLS ?= 200
FINEST ?= 200
# Whose map of errors is drawn; that of any model but the first is measured where it is not there.
MODEL ?= M1-concat
ifneq ($(words $(MODEL))$(findstring /,$(MODEL))$(filter .% -%,$(MODEL)),1)
$(error MODEL must be the plain name of a published model; received '$(MODEL)')
endif
MAP := $(if $(filter M1-concat,$(MODEL)),$(MEASUREMENTS)/surrogate_map,$(OUT)/measurements/surrogate_map-$(MODEL)).json
MAP_PLACE := $(if $(filter-out M1-concat,$(MODEL)),/$(MODEL))
SOAK ?= 100000
SOAK_BEYOND ?= 20000
COST_STYLE := $(DRAWING) paper_figures/style/cost_style.py experiments/paper_values/cost.toml
# BUSY=yes publishes seconds measured on a busy machine too.
BUSY ?=
# One measurement: its module, its options, its file where that has another name. `seconds` is for those that take any.
seconds = $(call measure,$(1),$(strip $(2) $(if $(BUSY),--busy)),$(3))
file_of = $(or $(3),$(lastword $(subst ., ,$(1))))
measure = $(PY) -m experiments.$(1) $(2) --out $(call measured,$(file_of)) && $(PY) $(MANIFEST) add $(call measured,$(file_of))
measured = $(MEASUREMENTS)/$(1).json
# One core: BLAS and the backends of the surrogates must not take more.
measure-% bench-surrogate bench-stream bench-training: export OMP_NUM_THREADS := 1

##@ Measurements (result file; on an idle machine)

.PHONY: measurements
MEASURED := bench-training $(addprefix measure-,effects canonical-times recommendations accuracy-cost cost-growth amortisation training-cost \
	hard-cases broad-band surrogate-map) bench-surrogate bench-stream bench-targets
measurements: $(MEASURED)  ## All of them but the soak
# Two measurements at once would measure each other.
.NOTPARALLEL: measurements

.PHONY: measure-effects
measure-effects: setup  ## Seconds and errors of scenes that add one effect at a time
	$(call seconds,effects.measure,,effects)

.PHONY: measure-recommendations
measure-recommendations: setup  ## How often `recommend` keeps its promise, and what it saves
	$(call seconds,effects.recommendations)

.PHONY: measure-canonical-times
measure-canonical-times: $(addprefix $(REFERENCE)/,run.json model.weights.h5) | $(INSTALLED)  ## Seconds of solver and surrogate on the twelve canonical protocols
	$(call seconds,paper.canonical_times,--config $(CONFIGS)/canonical_times.toml --models $(MODELS))

.PHONY: measure-accuracy-cost
measure-accuracy-cost: $(DATASET) | $(INSTALLED)  ## Seconds against errors of every tool (PROTOCOLS=200; FINEST=200 nodes of the paper's discretisation at most)
	$(call seconds,cost.accuracy_cost,--count $(PROTOCOLS) --finest $(FINEST) --dataset $(DATASET) --models $(PUBLISHED)/models)

.PHONY: measure-cost-growth
measure-cost-growth: $(DATASET) | $(INSTALLED)  ## How seconds grow with nodes, steps and the scene
	$(call seconds,cost.cost_growth,--dataset $(DATASET))

.PHONY: measure-amortisation
measure-amortisation: $(DATASET) $(MEASUREMENTS)/accuracy_cost.json | $(INSTALLED)  ## When a surrogate pays for itself; reads the measurement of accuracy and cost
	$(call measure,cost.amortisation,--cost $(MEASUREMENTS)/accuracy_cost.json --dataset $(DATASET) --models $(PUBLISHED)/models \
		--speed $(MEASUREMENTS)/training_speed.json)

.PHONY: measure-training-cost
measure-training-cost: $(DATASET) | $(INSTALLED)  ## Error against time of training, from what is published
	$(call measure,cost.training_cost,--dataset $(DATASET) --models $(PUBLISHED)/models --shares $(PUBLISHED)/data_efficiency.json \
		--speed $(MEASUREMENTS)/training_speed.json)

.PHONY: measure-hard-cases
measure-hard-cases: setup  ## The solver over the box, beyond it, and at named extremes, refined
	$(call measure,robustness.hard_case_map)

.PHONY: measure-surrogate-map
measure-surrogate-map: $(DATASET) | $(INSTALLED)  ## Errors of M1-concat over the box, worst trajectories, out of range
	$(call measure,robustness.surrogate_map,--model M1-concat --dataset $(DATASET) --models $(PUBLISHED)/models)

.PHONY: bench-startup
bench-startup: setup  ## Processor seconds of the first and of a warm run of bem simulate (BASELINE=REVISION beside it)
	$(PY) -m experiments.cost.startup $(addprefix --baseline ,$(BASELINE))

.PHONY: bench-targets
bench-targets: setup  ## What each target of REPRODUCING.md takes from published results (TARGETS="figure-1 ..." for some)
	$(call measure,cost.target_minutes,$(addprefix --only ,$(TARGETS)))

.PHONY: measure-broad-band
measure-broad-band: setup  ## Pull-off of broad-band solids over the unloading rate
	$(call measure,robustness.broad_band)
	$(PY) $(MANIFEST) add $(MEASUREMENTS)/broad_band.csv --command "python -m experiments.robustness.broad_band"

.PHONY: bench-surrogate
bench-surrogate: setup  ## What a prediction costs, against Keras's model.predict
	$(call seconds,cost.bench_surrogate,--models $(PUBLISHED)/models,surrogate_latency)

.PHONY: bench-training
bench-training: $(DATASET) | $(INSTALLED)  ## What a batch of training costs each of the eighteen
	$(call seconds,cost.training_speed,--dataset $(DATASET))

.PHONY: bench-stream
bench-stream: setup  ## The latency of a million steps of a stream
	$(call seconds,cost.bench_surrogate,--stream --models $(PUBLISHED)/models,stream_latency)

.PHONY: soak
soak: export OMP_NUM_THREADS := 1
soak: setup  ## SOAK=100000 random protocols in the box, SOAK_BEYOND=20000 beyond it; continues after an interruption
	$(call measure,robustness.soak,--count $(SOAK) --beyond $(SOAK_BEYOND))

# Who makes a measurement's file, where it is not the target of its name.
maker_of_hard_case_map := measure-hard-cases
maker_of_stream_latency := bench-stream
maker_of_surrogate_latency := bench-surrogate
maker_of_target_minutes := bench-targets
maker_of_training_speed := bench-training
maker_of_soak := soak
$(MEASUREMENTS)/%.json:
	@echo "$@ is missing; restore it from the repository, or run \`make $(or $(maker_of_$*),measure-$(subst _,-,$*))\`" >&2; exit 1

##@ Cost and hard cases (figure <- measurement)

.PHONY: cost-figures
DRAWN := figure-effects table-effects table-recommendations figure-accuracy-cost table-accuracy-cost figure-cost-growth \
	figure-amortisation figure-training-cost table-hard-cases figure-surrogate-map figure-broad-band
cost-figures: $(DRAWN)  ## All figures and tables below

.PHONY: figure-effects
figure-effects: $(FIGURES)/figure-effects.pdf  ## One path under seven scenes; when a simpler scene may stand in
$(FIGURES)/figure-effects.pdf: paper_figures/measurements/figure_effects.py $(MEASUREMENTS)/effects.json $(DRAWING) | $(INSTALLED)
	$(PY) -m paper_figures.measurements.figure_effects --result $(MEASUREMENTS)/effects.json --folder $(FIGURES)

.PHONY: table-effects
table-effects: $(TABLES)/effects.md  ## What each effect costs, and where a simpler scene is a safe stand-in
$(TABLES)/effects.md: paper_figures/tables/table_effects.py $(MEASUREMENTS)/effects.json $(DRAWING) | $(INSTALLED)
	$(PY) -m paper_figures.tables.table_effects --result $(MEASUREMENTS)/effects.json --folder $(TABLES)

.PHONY: table-recommendations
table-recommendations: $(TABLES)/recommendations.md  ## How often `recommend` keeps its promise
$(TABLES)/recommendations.md: paper_figures/tables/table_recommendations.py $(MEASUREMENTS)/recommendations.json $(DRAWING) | $(INSTALLED)
	$(PY) -m paper_figures.tables.table_recommendations --result $(MEASUREMENTS)/recommendations.json --folder $(TABLES)

.PHONY: figure-accuracy-cost
figure-accuracy-cost: $(FIGURES)/figure-accuracy-cost.pdf  ## Seconds against error, every tool on one chart
$(FIGURES)/figure-accuracy-cost.pdf: paper_figures/measurements/figure_accuracy_cost.py $(MEASUREMENTS)/accuracy_cost.json \
		$(COST_STYLE) | $(INSTALLED)
	$(PY) -m paper_figures.measurements.figure_accuracy_cost --result $(MEASUREMENTS)/accuracy_cost.json --folder $(FIGURES)

.PHONY: table-accuracy-cost
table-accuracy-cost: $(TABLES)/accuracy-cost.md  ## The same as a table, and the fastest tool for a wanted error
$(TABLES)/accuracy-cost.md: paper_figures/tables/table_accuracy_cost.py $(MEASUREMENTS)/accuracy_cost.json $(COST_STYLE) | $(INSTALLED)
	$(PY) -m paper_figures.tables.table_accuracy_cost --result $(MEASUREMENTS)/accuracy_cost.json --folder $(TABLES)

.PHONY: figure-cost-growth
figure-cost-growth: $(FIGURES)/figure-cost-growth.pdf  ## How seconds grow, with fitted powers; and its table
$(FIGURES)/figure-cost-growth.pdf: paper_figures/measurements/figure_cost_growth.py $(MEASUREMENTS)/cost_growth.json $(COST_STYLE) | $(INSTALLED)
	$(PY) -m paper_figures.measurements.figure_cost_growth --result $(MEASUREMENTS)/cost_growth.json --folder $(FIGURES) --tables $(TABLES)

.PHONY: figure-amortisation
figure-amortisation: $(FIGURES)/figure-amortisation.pdf  ## When a surrogate pays for itself; and its table
$(FIGURES)/figure-amortisation.pdf: paper_figures/measurements/figure_amortisation.py $(MEASUREMENTS)/amortisation.json $(DRAWING) | $(INSTALLED)
	$(PY) -m paper_figures.measurements.figure_amortisation --result $(MEASUREMENTS)/amortisation.json --folder $(FIGURES) --tables $(TABLES)

.PHONY: figure-training-cost
figure-training-cost: $(FIGURES)/figure-training-cost.pdf  ## Error against time of training and number of trajectories
$(FIGURES)/figure-training-cost.pdf: paper_figures/measurements/figure_training_cost.py $(MEASUREMENTS)/training_cost.json $(DRAWING) | $(INSTALLED)
	$(PY) -m paper_figures.measurements.figure_training_cost --result $(MEASUREMENTS)/training_cost.json --folder $(FIGURES)

.PHONY: table-hard-cases figure-hard-cases
figure-hard-cases: table-hard-cases
table-hard-cases: $(FIGURES)/figure-hard-cases.pdf  ## Where the solver works hard, as a map and a table, and what the soak found
$(FIGURES)/figure-hard-cases.pdf: paper_figures/measurements/figure_hard_cases.py $(MEASUREMENTS)/hard_case_map.json \
		$(wildcard $(MEASUREMENTS)/soak.json) $(DRAWING) | $(INSTALLED)
	$(PY) -m paper_figures.measurements.figure_hard_cases --result $(MEASUREMENTS)/hard_case_map.json --soak $(MEASUREMENTS)/soak.json \
		--folder $(FIGURES) --tables $(TABLES)

.PHONY: figure-surrogate-map
figure-surrogate-map: $(FIGURES)$(MAP_PLACE)/figure-surrogate-map.pdf  ## Where MODEL=M1-concat errs, its worst twenty trajectories, and their table
$(FIGURES)$(MAP_PLACE)/figure-surrogate-map.pdf: paper_figures/measurements/figure_surrogate_map.py $(MAP) $(COST_STYLE) | $(INSTALLED)
	$(PY) -m paper_figures.measurements.figure_surrogate_map --result $(MAP) --folder $(FIGURES)$(MAP_PLACE) --tables $(TABLES)$(MAP_PLACE)

# Another model's map is not published.
$(OUT)/measurements/surrogate_map-$(MODEL).json: $(DATASET) | $(INSTALLED)
	$(PY) -m experiments.robustness.surrogate_map --model $(MODEL) --dataset $(DATASET) --models $(PUBLISHED)/models --out $@

.PHONY: figure-broad-band
figure-broad-band: $(FIGURES)/figure-broad-band.pdf  ## Pull-off of broad-band solids over the unloading rate
$(FIGURES)/figure-broad-band.pdf: paper_figures/measurements/figure_broad_band.py $(MEASUREMENTS)/broad_band.json $(DRAWING) | $(INSTALLED)
	$(PY) -m paper_figures.measurements.figure_broad_band --result $(MEASUREMENTS)/broad_band.json --folder $(FIGURES)

.PHONY: docs-effects
docs-effects: figure-effects  ## Renew the picture of docs/effects.md
	cp $(FIGURES)/figure-effects.png docs/images/

.PHONY: docs-cost
docs-cost: $(MEASUREMENTS)/accuracy_cost.json $(COST_STYLE) | $(INSTALLED)  ## Renew the table of the fastest tools in docs/cost.md
	$(PY) -m paper_figures.tables.table_accuracy_cost --result $< --folder $(TABLES) --page docs/cost.md

.PHONY: docs-control
docs-control: setup  ## Renew the seconds of a prediction and of a step in docs/control.md, as published
	$(PY) -m experiments.cost.bench_surrogate --page docs/control.md
