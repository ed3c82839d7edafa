# Front door. Every target installs and builds what it needs.
SHELL := /bin/bash
.SHELLFLAGS := -o pipefail -c
.DEFAULT_GOAL := help

JOBS   ?= $(shell nproc)
PRESET := $(if $(filter 1,$(SAN)),asan,release)
BUILD  := build/$(PRESET)
O2V    := build/release/option2vec

.PHONY: help deps build test clean gradcheck parity oracles bench reproduce lint lint-tidy format golden

help:  ## lists the targets
	@awk -F ':.*## ' '/^[a-z-]+:.*## /{printf "make %-10s %s\n", $$1, $$2}' $(MAKEFILE_LIST)

deps:  ## installs the Debian packages that are missing
	@scripts/deps.sh

build: deps  ## builds program, tests and benches (SAN=1: under ASan and UBSan)
	@cmake --preset $(PRESET) > /dev/null
	@cmake --build --preset $(PRESET)

test: build  ## runs all tests (SAN=1: under ASan and UBSan)
	@ctest --test-dir $(BUILD) --output-on-failure -j2

clean:  ## removes what was built; results stay
	@rm -rf build

gradcheck: build  ## analytic against numeric gradients; writes results/gradcheck.csv
	@mkdir -p results && build/release/tests/gradcheck

parity: build  ## physics against the reference numbers; writes results/parity.csv
	@mkdir -p results && build/release/tests/parity

ORACLES ?= tests/data/oracles
oracles: build  ## losses, gradients, updates against the numbers in ORACLES=DIR
	@build/release/tests/oracles $(ORACLES)

bench: build  ## cost of a layer and of an environment step beside its bound
	@build/release/bench/o2v_bench

SUITE ?= quick
LISTS := $(if $(FIDELITY),--fidelity $(FIDELITY)) $(if $(SEEDS),--seeds $(SEEDS)) \
         $(if $(TASKS),--tasks $(TASKS)) $(if $(ALGOS),--algos $(ALGOS))
reproduce: build  ## trains and tabulates SUITE=quick (FIDELITY= SEEDS= TASKS= ALGOS= JOBS=)
	@$(O2V) jobs $(SUITE) $(LISTS) | xargs -P $(JOBS) -d '\n' -r -n 1 scripts/run_job.sh
	@$(O2V) summary results/$(basename $(notdir $(SUITE)))

lint: deps  ## formatting and include layering
	@find src tests bench -name '*.cc' -o -name '*.h' | xargs clang-format --dry-run -Werror
	@scripts/lint_layers.sh

lint-tidy: build  ## clang-tidy on the files changed since BASE=HEAD
	@scripts/lint_tidy.sh $(or $(BASE),HEAD)

format: deps  ## clang-format on all sources
	@find src tests bench -name '*.cc' -o -name '*.h' | xargs clang-format -i

golden: build  ## rewrites the golden files; review the difference
	@O2V_REWRITE_GOLDEN=1 build/release/tests/test_golden
