# `make demo` sets everything up and runs the main job, `make test` runs every check.
SHELL := /bin/bash
.SHELLFLAGS := -euo pipefail -c
.DEFAULT_GOAL := help
.DELETE_ON_ERROR:

VENV := .venv
BIN := $(VENV)/bin
PY := $(BIN)/python
RUST_SOURCES := $(shell find rust -name '*.rs' -o -name Cargo.toml 2>/dev/null) Cargo.toml $(wildcard Cargo.lock build.rs rust-toolchain.toml)
TOOLS := $(VENV)/.tools
DEPENDENCIES := $(VENV)/.dependencies
SUBSET := out/proof-40
# one thread per worker, or the workers wait for each other; what many threads do is asked for by the tests of it
PYTEST := OPENBLAS_NUM_THREADS=1 HDFAST_NUM_THREADS=1 $(PY) -m pytest --numprocesses auto --maxprocesses 8 --dist worksteal
# suites with tests that need --long and that CI has the time for; the longest first, for its fixtures are stolen last
LONG := diagnosis_nulls diagnosis_anchors diagnosis diagnosis_corners diagnosis_statistics identify_kinematic_error \
  identify_stiffness identify_friction invariants terms_oracles proof_generator article instructions diagnosis_page \
  diagnosis_proof diagnosis_sensors diagnosis_unknown diagnosis_experiment diagnosis_lateness proof_rivals proof_bridge \
  studies_claims tolerance_cluster cli tolerance_study
EXTENSION := $(VENV)/.extension

export VIRTUAL_ENV := $(CURDIR)/$(VENV)
export PYO3_PYTHON := $(CURDIR)/$(PY)
export PIP_DISABLE_PIP_VERSION_CHECK := 1
export PIP_QUIET := 1

.PHONY: help setup demo test test-rust test-whole proof-subset bench bench-peers profile clean lint

help:
	@echo "make setup   environment in $(VENV) and release build of the extension"
	@echo "make demo    set up, then 10,000 Monte Carlo rows of a real drive into out/demo,"
	@echo "             and the diagnosis of a drive with concealed friction into out/diagnosis"
	@echo "make test    set up, then the tests, lint and type check"
	@echo "make test-whole     what takes longer: sweeps from Rust, a hundred diagnoses of complete models, those of single"
	@echo "             effects, and references in full size"
	@echo "make proof-subset   set up, then forty blind cases, held against what they must not fall below"
	@echo "make bench   set up, then the speed measurements"
	@echo "make bench-peers   set up, then work-precision against other solvers, each in its own environment"
	@echo "make profile set up, then where the engine spends its time: target/profile/flame.svg"
	@echo "make clean   remove everything that was built"

setup: $(EXTENSION)

$(TOOLS): tools/check-tools
	@tools/check-tools $(MAKE_VERSION) > /dev/null
	@python=$$(tools/check-tools $(MAKE_VERSION)); "$$python" -m venv $(VENV) || \
	  { echo "hdfast needs Python's venv module: install the package 'python3-venv' of your system and run make again." >&2; exit 2; }
	@touch $@

$(DEPENDENCIES): pyproject.toml tools/requirements.py | $(TOOLS)
	@echo "Installing Python packages into $(VENV) ..."
	@$(PY) tools/requirements.py dev > $(VENV)/requirements.txt
	@$(PY) -m pip install --quiet --requirement $(VENV)/requirements.txt
	@touch $@

$(EXTENSION): $(RUST_SOURCES) $(DEPENDENCIES)
	@tools/check-tools $(MAKE_VERSION) > /dev/null
	@echo "Building the release extension, a few minutes the first time ..."
	$(BIN)/maturin develop --release --quiet
	@touch $@

demo: setup
	$(BIN)/hdfast sweep examples/shf-25-120.toml --out out/demo
	$(BIN)/hdfast diagnose examples/concealed-friction/campaign.toml --out out/diagnosis

lint: $(DEPENDENCIES)
	@tools/check-tools $(MAKE_VERSION) lint > /dev/null
	cargo fmt --all --check
	cargo clippy --quiet --workspace --all-targets -- -D warnings
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy

test-rust: $(DEPENDENCIES)
	cargo test --quiet --lib

test: $(DEPENDENCIES)
	@echo "Checking the sources while the extension is built ..."
	@$(MAKE) --no-print-directory --jobs 2 --output-sync lint test-rust setup
	$(PY) -m mypy.stubtest hdfast._core
	$(PYTEST)

test-whole: setup
	cargo test --release --test '*'
	$(PYTEST) --long -m long $(LONG:%=tests/python/test_%.py)

proof-subset: setup
	rm -rf $(SUBSET)
	$(BIN)/hdfast proof --cases 40 --seed 7 --out $(SUBSET) --quiet || [ $$? -eq 1 ]
	$(PY) tools/check_proof.py $(SUBSET)/proof.json

bench: setup
	$(PY) tools/requirements.py bench | xargs $(PY) -m pip install --quiet
	cargo bench
	$(PY) benches/compare_numba.py
	$(PY) benches/compare_features.py

bench-peers: setup
	$(PY) tools/requirements.py bench | xargs $(PY) -m pip install --quiet
	$(PY) benches/limits.py
	$(PY) benches/peers/compare.py

profile: setup
	$(BIN)/maturin develop --profile profiling --quiet
	$(PY) tools/flame.py

clean:
	rm -rf $(VENV) target out .hypothesis .mypy_cache .pytest_cache .ruff_cache
	find python tests -name '__pycache__' -type d -prune -exec rm -rf {} +
	rm -f python/hdfast/_core*.so
