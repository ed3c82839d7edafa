# Every target installs and builds what it needs.
SHELL := /bin/bash
.SHELLFLAGS := -o pipefail -c
.DEFAULT_GOAL := help

JOBS   ?= $(shell nproc)
PHYSICS ?= upstream
PRESET := $(if $(filter 1,$(SAN)),asan,release)
O2V    := build/$(PRESET)/option2vec
COMPILE = cmake --preset $(PRESET) > /dev/null && cmake --build --preset $(PRESET)

.PHONY: help deps build test clean gradcheck parity theory oracles bench bench-peers reproduce policies watch timelines lint lint-tidy format golden report plots torture fuzz

help:  ## list the targets
	@awk -F ':.*## ' '/^[a-z-]+:.*## /{printf "make %-11s %s\n", $$1, $$2}' $(MAKEFILE_LIST)

deps:  ## install missing packages (PHYSICS=debian: Debian's libmujoco, not PyPI's faster one; FILM=1: for films)
	@FILM=$(FILM) scripts/deps.sh
	@PHYSICS=$(PHYSICS) scripts/deps_physics.sh

build: deps  ## build program, tests and benches (SAN=1: with ASan and UBSan)
	@$(COMPILE)

test: build  ## run all tests (SAN=1: with ASan and UBSan)
	@ctest --test-dir build/$(PRESET) --output-on-failure -j2

clean:  ## remove the build; results stay
	@rm -rf build

gradcheck: deps  ## compare analytic with numeric gradients; write results/gradcheck.csv
	@$(COMPILE) --target gradcheck
	@build/$(PRESET)/tests/gradcheck

parity: deps  ## compare the physics with the reference's numbers; write results/parity.csv
	@$(COMPILE) --target parity
	@build/$(PRESET)/tests/parity

theory: deps  ## check the paper's statements on small exact processes; write results/theory.csv
	@$(COMPILE) --target theory
	@build/$(PRESET)/tests/theory

ORACLES ?= tests/data/oracles
oracles: deps  ## compare losses, gradients and updates with the numbers in ORACLES=DIR
	@$(COMPILE) --target oracles
	@build/$(PRESET)/tests/oracles $(ORACLES)

bench: deps  ## measure layers and environment steps beside the bound; write results/bench.json
	@$(COMPILE) --target o2v_bench
	@build/$(PRESET)/bench/o2v_bench --benchmark_out=results/bench.json --benchmark_out_format=json
	@$(PYTHON) -m bench.grid_hours

# Several gigabytes of packages go into a place of their own.
bench-peers: deps  ## CPU time beside Stable-Baselines3, gymnasium, EnvPool; writes docs/performance.md
	@$(COMPILE) --target option2vec o2v_bench
	@test -x build/peers/bin/python || /usr/bin/python3 -m venv build/peers
	@build/peers/bin/python -m pip install -q -r bench/peers/requirements.txt
	@$(PYTHON) bench/peers/peers.py $(PEERS)

SUITE    ?= paper
FIDELITY ?= $(if $(filter paper single_task transfer ablation,$(SUITE)),paper)
comma    := ,
SUITES   := $(if $(filter paper,$(SUITE)),single_task transfer,$(SUITE))
GRID     := $(SUITES) $(if $(FIDELITY),--fidelity $(FIDELITY:both=paper$(comma)released)) \
            $(if $(SEEDS),--seeds $(SEEDS)) $(if $(TASKS),--tasks $(TASKS)) $(if $(ALGOS),--algos $(ALGOS))
reproduce: deps  ## rerun the paper, or SUITE=quick (FIDELITY= SEEDS= TASKS= ALGOS= JOBS=)
	@$(COMPILE) --target option2vec $(if $(filter paper,$(SUITE)),gradcheck)
	@if [ $(SUITE) = paper ]; then build/$(PRESET)/tests/gradcheck | tail -n 1; fi
	@$(O2V) progress $(GRID) --at-once $(JOBS)
	@$(O2V) jobs $(GRID) | \
	    GRID="$(GRID) --at-once $(JOBS)" xargs -P $(JOBS) -d '\n' -r -n 1 scripts/run_job.sh
	@$(O2V) summary $$(ls -d $(foreach suite,$(SUITES),results/$(basename $(notdir $(suite)))) 2> /dev/null)
	@if [ $(SUITE) = paper ]; then $(MAKE) --no-print-directory report; fi

# Records do not hold a policy, so that these runs are made anew, in a folder of their own.
POLICY_GRID = single_task transfer --fidelity paper,released --algos option2vec --seeds 0 \
              $(if $(TASKS),--tasks $(TASKS)) --results runs/policies
policies: deps  ## train Option2Vec, seed 0, and write results/policies (TASKS= JOBS=)
	@$(COMPILE) --target option2vec
	@$(O2V) jobs $(POLICY_GRID) | \
	    GRID="$(POLICY_GRID) --at-once $(JOBS)" xargs -P $(JOBS) -d '\n' -r -n 1 scripts/run_job.sh
	@scripts/policies.sh $(O2V) runs/policies

TASK   ?= HalfCheetah-v2
WATCHED = $(TASK)-$(if $(filter file,$(origin FIDELITY)),released,$(FIDELITY))
watch:  ## evaluate and film a trained policy, build/films/*.mp4 (TASK=HalfCheetah-v2 FIDELITY=released)
	@$(MAKE) --no-print-directory deps FILM=1
	@$(COMPILE) --target option2vec
	@mkdir -p build/films
	@$(O2V) eval --checkpoint results/policies/$(WATCHED).safetensors --task $(TASK) --episodes 3 \
	    --action mean
	@$(O2V) film --checkpoint results/policies/$(WATCHED).safetensors --task $(TASK) --action mean \
	    --size 480x360 --out build/films/$(WATCHED).mp4

timelines: deps  ## draw the options over an episode of each trained policy: build/timelines
	@$(COMPILE) --target option2vec
	@mkdir -p build/timelines
	@for file in results/policies/*.safetensors; do \
	    name=$$(basename $$file .safetensors); \
	    $(O2V) eval --checkpoint $$file --task $${name%-*} --episodes 5 --action mean > /dev/null \
	        --trajectory build/timelines/$$name.csv || exit; \
	done
	@$(PYTHON) -m plots.timeline --out build/timelines $(patsubst \
	    results/policies/%.safetensors,build/timelines/%.csv,$(wildcard results/policies/*.safetensors))
	@cp build/timelines/options.csv results/policies/options.csv

# Debian's Python, which sees Debian's packages. -B: no caches beside the sources.
PYTHON := /usr/bin/python3 -B
CHOICE  = $(addprefix --experiment ,$(EXPERIMENTS))
# The program writes its tables where it is newer than they are; a fresh clone has them, unbuilt.
results/params.csv: ARGUMENTS = params --csv
results/registry.json: ARGUMENTS = list --json
results/params.csv results/registry.json: $(wildcard $(O2V))
	@[ -x $(O2V) ] || { scripts/deps.sh && $(COMPILE) --target option2vec; }
	@$(O2V) $(ARGUMENTS) > $@.new && mv $@.new $@

PLOTTING := python3 python3-numpy python3-scipy python3-matplotlib
# A report on own runs or another experiment leaves what is committed as it is.
report: $(if $(EXPERIMENTS)$(MINE),,results/params.csv results/registry.json)  ## write results/REPORT.md, report.html, README's box (EXPERIMENTS=ci: in results/ci; MINE=)
	@scripts/deps.sh $(PLOTTING)
	@$(PYTHON) -m plots.long_table
	@$(PYTHON) -m plots.report $(CHOICE) $(addprefix --mine ,$(MINE)) \
	    $(if $(CHOICE),--out results/$(firstword $(EXPERIMENTS)),$(if $(MINE),--out results/mine))
	@$(if $(CHOICE)$(MINE),,$(PYTHON) -m plots.front)

plots:  ## draw the figures alone: plots/*.svg and *.png
	@scripts/deps.sh $(PLOTTING)
	@for script in plots/fig_*.py; do $(PYTHON) -m plots.$$(basename $$script .py) || exit; done

lint: deps  ## check formatting, include layering, cited sections, links and lengths of the pages
	@find src tests bench -name '*.cc' -o -name '*.h' | xargs clang-format --dry-run -Werror
	@scripts/lint_layers.sh
	@scripts/lint_spec.sh
	@scripts/lint_links.sh

lint-tidy: build  ## run clang-tidy on the files changed since BASE=HEAD
	@scripts/lint_tidy.sh $(or $(BASE),HEAD)

format: deps  ## run clang-format on all sources
	@find src tests bench -name '*.cc' -o -name '*.h' | xargs clang-format -i

golden: deps  ## rewrite the golden files; review the difference
	@$(COMPILE) --target test64_golden test_report
	@O2V_REWRITE_GOLDEN=1 build/$(PRESET)/tests/test64_golden
	@O2V_REWRITE_GOLDEN=1 build/$(PRESET)/tests/test_report --gtest_filter=ParamTable.IsTheOneOnRecord

TORTURE ?=
torture: deps  ## disturb runs with kills, full disks, limits, signals, races (TORTURE="--scale 0.1")
	@$(COMPILE) --target option2vec
	@$(PYTHON) tests/torture/torture.py --program $(O2V) $(TORTURE)

# libFuzzer saves new inputs in build/, so that the committed corpus stays small.
RUNS    ?= 10000000
SECONDS ?= 600
TARGETS ?= checkpoint csv toml record jobs
fuzz: deps  ## run libFuzzer on all readers of files, with clang (per target RUNS= SECONDS=; TARGETS=)
	@command -v clang++ > /dev/null || { echo "make fuzz: needs clang and libclang-rt-dev"; exit 1; }
	@cmake --preset fuzz > /dev/null && cmake --build --preset fuzz --target $(TARGETS:%=fuzz_%)
	@for target in $(TARGETS); do \
	    mkdir -p build/fuzz/corpus/$$target && echo "$$target" && \
	    build/fuzz/tests/fuzz_$$target -runs=$(RUNS) -max_total_time=$(SECONDS) -timeout=10 -max_len=4096 \
	        -artifact_prefix=build/fuzz/$$target- -print_final_stats=1 \
	        build/fuzz/corpus/$$target tests/fuzz/corpus/$$target || exit; \
	done
