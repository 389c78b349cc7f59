# Everything runs in the virtual environment .venv; the system's Python is used only to create it.
# All paths are relative, so a checkout below a directory whose name contains spaces works as well.

PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
RUN_STAMP := $(VENV)/.installed-for-running
DEV_STAMP := $(VENV)/.installed-for-development
DOCS_STAMP := $(VENV)/.installed-for-docs
LOWEST := $(VENV)/lowest
LOWEST_STAMP := $(LOWEST)/.installed
PEERS := $(VENV)/bench
PEERS_STAMP := $(PEERS)/.installed
PIP := $(BIN)/python -m pip --disable-pip-version-check --quiet
# pip would compile all of the libraries, ten times what is imported. What any command imports is imported once, so that
# Python keeps its bytecode: where an environment forbids that later, each start would take seconds.
INSTALL := $(PIP) install --no-compile --editable
BYTECODE := $(BIN)/python -m benchmarks.imports
unexport PYTHONDONTWRITEBYTECODE
CASES := $(sort $(wildcard cases/*.toml))
# PYTEST_ARGS=-n0 takes one process alone.
PYTEST := -m pytest --numprocesses 2 --dist loadfile
PYTEST_ARGS ?=
BENCH_ARGS ?=
POINTS ?=
BEFORE ?= HEAD

.DEFAULT_GOAL := help
.DELETE_ON_ERROR:
.NOTPARALLEL: # two installations into one .venv at a time would collide
.PHONY: help demo test campaign lowest lint format types imports derivations tables docs cases check \
    accuracy promises promise-cost statistics picture lock-in branch-picture scatter-picture loop-picture basin-picture regime-pictures paper extremes bench bench-sweep bench-million bench-contact bench-branch fingerprint size words clean

help: ## list the targets (this text)
	@echo "make TARGET, where TARGET is one of"
	@sed -n 's/^\([a-z][a-z-]*\):[^#]*## \(.*\)$$/\1|\2/p' Makefile \
	    | while IFS='|' read -r target text; do printf '  %-12s %s\n' "$$target" "$$text"; done
	@echo "PYTHON=... chooses the Python (3.11 or later) that creates $(VENV)."

$(BIN)/python:
	@"$(PYTHON)" -c 'import sys; sys.exit(sys.version_info < (3, 11))' \
	    || { echo "brakecli needs Python 3.11 or later; name one: make PYTHON=/path/to/python3" >&2; exit 1; }
	@"$(PYTHON)" -m venv --clear $(VENV) \
	    || { rm -rf $(VENV); \
	         echo "cannot create $(VENV); is Python's venv module installed (python3-venv on Debian)?" >&2; \
	         exit 1; }
	@$(PIP) install --upgrade pip || true # older ones search twice as long for what fits together

# The installation is editable: it always runs the code that is here. It is renewed when the dependencies, the version
# or the Python have changed.
INSTALLED_FROM := pyproject.toml brakecli/about.py $(BIN)/python

$(RUN_STAMP): $(INSTALLED_FROM)
	@echo "installing brakecli into $(VENV) ..."
	@$(INSTALL) '.[tour]'
	@$(BYTECODE)
	@touch $@

$(DEV_STAMP): $(INSTALLED_FROM)
	@echo "installing brakecli and its development tools into $(VENV) ..."
	@$(INSTALL) '.[dev]'
	@$(BYTECODE)
	@touch $@ $(RUN_STAMP)

$(DOCS_STAMP): $(DEV_STAMP)
	@$(INSTALL) '.[docs]'
	@touch $@

$(LOWEST_STAMP): $(INSTALLED_FROM)
	@echo "installing brakecli with the lowest versions that it declares into $(LOWEST) ..."
	@$(BIN)/python -m venv --clear $(LOWEST)
	@$(LOWEST)/bin/python -m pip --disable-pip-version-check --quiet install uv
	@$(LOWEST)/bin/uv pip install --quiet --python $(LOWEST)/bin/python --resolution lowest-direct --editable '.[dev]'
	@touch $@

# Peers have an environment of their own. numbalsoda is compiled there and needs a Fortran compiler: without it the
# others are measured, and pip says why.
$(PEERS_STAMP): $(INSTALLED_FROM)
	@echo "installing brakecli and the solvers that it is compared with into $(PEERS) ..."
	@$(BIN)/python -m venv --clear $(PEERS)
	@$(PEERS)/bin/python -m pip --disable-pip-version-check --quiet install --editable '.[bench]'
	@$(PEERS)/bin/python -m pip --disable-pip-version-check --quiet install numbalsoda \
	    || echo "numbalsoda is not installed; it needs gfortran, and make bench again after make clean" >&2
	@touch $@

demo: $(RUN_STAMP) ## install into .venv and run one real case, cases/relaxation.toml
	@mkdir -p results
	$(BIN)/brakecli run cases/relaxation.toml --force --output results/relaxation.h5
	@echo
	@echo "What to look at: the regime is 'relaxation'. In every cycle the shoe sticks to the wheel, is carried"
	@echo "along, breaks loose and slips back; stick_fraction is the part of the time that it sticks."
	@echo "The time histories and spectra are in results/relaxation.h5, for h5py, or for xarray with h5netcdf:"
	@echo "  xarray.open_dataset('results/relaxation.h5', group='history', engine='h5netcdf')"
	@echo "Next: change a value, as in  $(BIN)/brakecli run cases/relaxation.toml --set friction.coefficient=0.5 -o results/mine.h5"

# Compiles all kernels, once, and says so: the tests would wait for them in silence.
KERNELS := mkdir -p results; $(BIN)/brakecli run cases/relaxation.toml --force --output results/kernels.h5 >/dev/null

test: $(DEV_STAMP) ## run the tests; PYTEST_ARGS='-k friction' narrows them down
	@$(KERNELS)
	$(BIN)/python $(PYTEST) $(PYTEST_ARGS)

campaign: $(DEV_STAMP) docs ## run long tests and statistics, of most of which make test has a smaller part (16 minutes)
	@$(KERNELS)
	$(BIN)/python $(PYTEST) -n3 -m campaign $(PYTEST_ARGS) # one more, as many of these wait for seconds

lowest: $(LOWEST_STAMP) ## run the tests with every dependency at the lowest version that pyproject.toml declares
	$(LOWEST)/bin/python $(PYTEST) $(PYTEST_ARGS)

lint: $(DEV_STAMP) ## check style and formatting, change nothing
	$(BIN)/python -m ruff check .
	$(BIN)/python -m ruff format --check .

format: $(DEV_STAMP) ## rewrite the sources in the project's format
	$(BIN)/python -m ruff check --fix .
	$(BIN)/python -m ruff format .

types: $(DEV_STAMP) ## check the type annotations
	$(BIN)/python -m mypy

imports: $(DEV_STAMP) ## check that imports point only down the list of layers
	$(BIN)/lint-imports --no-cache --no-logo

derivations: $(DEV_STAMP) ## derive every formula of the documentation again, with sympy
	$(BIN)/python docs/derivations.py

tables: $(DEV_STAMP) ## write the tables of the documentation that list what a result holds
	$(BIN)/python docs/tables.py

docs: $(DOCS_STAMP) ## run the tutorial and make the site of the documentation in docs/_site/html; a warning fails
	$(BIN)/python -m sphinx --fail-on-warning --keep-going --quiet docs docs/_site/html

cases: $(RUN_STAMP) ## run every sample case into results/; one that fails, fails all
	@mkdir -p results
	@failed=; \
	for case in $(CASES); do \
	    name=$$(basename "$$case" .toml); \
	    echo "run $$case"; \
	    $(BIN)/brakecli run "$$case" --force --quiet --output "results/$$name.h5" || failed="$$failed $$name"; \
	done; \
	if [ -n "$$failed" ]; then echo "failed:$$failed" >&2; exit 1; fi

accuracy: $(DEV_STAMP) ## compare all schemes on cases/accuracy and draw the pictures of docs/accuracy.md
	@mkdir -p results
	@for case in S B C; do \
	    $(BIN)/brakecli compare-schemes "cases/accuracy/$$case.toml" --budget 60 --force \
	        --output "results/accuracy-$$case.h5" || exit 1; \
	    $(BIN)/brakecli plot "results/accuracy-$$case.h5" --force --output "docs/accuracy-$$case.png" || exit 1; \
	done

picture: $(DEV_STAMP) ## draw docs/picture.png, from cases/relaxation.toml
	@mkdir -p results
	$(BIN)/brakecli run cases/relaxation.toml --force --quiet --output results/relaxation.h5
	$(BIN)/brakecli plot results/relaxation.h5 --force --output docs/picture.png

lock-in: $(DEV_STAMP) ## draw docs/lock-in.png, from cases/mode-coupling.toml
	@mkdir -p results
	$(BIN)/brakecli stability cases/mode-coupling.toml --vary friction.coefficient=0:1.5:151 --force --quiet -o results/lock-in.h5
	$(BIN)/brakecli plot results/lock-in.h5 --force --output docs/lock-in.png

branch-picture: $(DEV_STAMP) ## draw docs/branch.png, from the starter of branches
	@mkdir -p results
	$(BIN)/brakecli new branch --output results/branch.toml --force --quiet
	$(BIN)/brakecli branch results/branch.toml --parameter friction.coefficient=0:1 --force --quiet -o results/branch.h5
	$(BIN)/brakecli plot results/branch.h5 --force --output docs/branch.png

scatter-picture: $(DEV_STAMP) ## draw docs/scatter.png, from the starter of scatter
	@mkdir -p results
	$(BIN)/brakecli new scatter --output results/scatter.toml --force --quiet
	$(BIN)/brakecli scatter results/scatter.toml --force --quiet -o results/scatter.h5
	$(BIN)/brakecli plot results/scatter.h5 --force --output docs/scatter.png

loop-picture: $(DEV_STAMP) ## draw docs/loop.png, from the starter of branches, followed up and down
	@mkdir -p results
	$(BIN)/brakecli new branch --output results/branch.toml --force --quiet
	$(BIN)/brakecli sweep docs/loop.toml --force --quiet -o results/loop.h5
	$(BIN)/brakecli plot results/loop.h5 --select solver.duration=200 --force --output docs/loop.png

basin-picture: $(DEV_STAMP) ## draw docs/basin.png: which starts of the same shoe lead to vibration
	@mkdir -p results
	$(BIN)/brakecli new branch --output results/branch.toml --force --quiet
	$(BIN)/brakecli sweep docs/basin.toml --force --quiet -o results/basin.h5 \
	    --set 'initial.at="equilibrium"' --set solver.duration=40
	$(BIN)/brakecli plot results/basin.h5 --force --output docs/basin.png

regime-pictures: $(DEV_STAMP) ## draw docs/regimes-*.png, an example of each verdict; fails where a verdict has changed (a minute)
	$(BIN)/python docs/regime_pictures.py

paper: $(DEV_STAMP) ## reproduce the paper's claims into docs/paper-claims.md, with pictures (some minutes)
	$(BIN)/python docs/paper_claims.py

promises: $(DEV_STAMP) ## random cases at five tolerances: the tables of docs/accuracy.md (some minutes)
	$(BIN)/python -m benchmarks.promises

promise-cost: $(DEV_STAMP) ## a tolerance beside the cheapest entry that keeps it: a table of docs/accuracy.md (some minutes)
	$(BIN)/python -m benchmarks.promise_cost

statistics: $(DEV_STAMP) ## large draws, once per change that may move them, and docs/statistics.md (an hour)
	$(BIN)/python -m benchmarks.statistics
	$(BIN)/python $(PYTEST) -m statistics $(PYTEST_ARGS)
	$(BIN)/python $(PYTEST) -m campaign -n0 -s -k "few_shoes_stay or threshold_twice" tests/analysis/test_score.py

bench: $(PEERS_STAMP) ## measure brakecli beside general solvers and write docs/performance.md; fails where it lost ground (ten minutes)
	$(PEERS)/bin/python -m benchmarks.performance $(BENCH_ARGS)

bench-sweep: $(DEV_STAMP) ## what a sweep costs beside its points; needs two idle cores (some minutes)
	$(BIN)/python -m benchmarks.sweep

bench-million: $(DEV_STAMP) ## a million points, made up and of a rough shoe, over dask workers, some killed; POINTS=20000 (an hour)
	$(BIN)/python -m benchmarks.million $(POINTS)

bench-contact: $(DEV_STAMP) ## what the contact costs, against C; needs gcc and an idle core (some minutes)
	$(BIN)/python -m benchmarks.contact

bench-branch: $(DEV_STAMP) ## what branches of 200 random shoes cost, and how many get through; needs an idle core (a minute)
	$(BIN)/python -m benchmarks.branches

fingerprint: $(DEV_STAMP) ## compare all numbers of the working tree with those of a commit, BEFORE=v0.7.0 (some minutes)
	$(BIN)/python -m benchmarks.fingerprint $(BEFORE)

size: $(DEV_STAMP) ## weigh the package by its tokens, and name what is too long
	$(BIN)/python -m benchmarks.size

words: $(DEV_STAMP) ## count the words of the documentation outside code and tables
	$(BIN)/python -m benchmarks.words

extremes: $(DEV_STAMP) ## compute the extremes of all inputs and write docs/extremes.md (a minute)
	$(BIN)/python -m benchmarks.extremes

check: lint types imports derivations cases test ## all that must hold before a change is handed in

clean: ## remove .venv, results and caches
	rm -rf $(VENV) docs/_site docs/generated results build dist .mypy_cache .ruff_cache .pytest_cache .hypothesis .import_linter_cache
	find . -name __pycache__ -type d -prune -exec rm -rf {} +
