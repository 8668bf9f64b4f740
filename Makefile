# `make demo` and `make test` need Python 3.11, make and a package index; nothing else.
PYTHON ?= $(shell command -v python3.11 || command -v python3)
VENV := .venv
BIN := $(VENV)/bin
INBOX ?= inbox
# Our own threads use the cores; the linear algebra libraries must not fight them for it.
export OMP_NUM_THREADS ?= 1
export PIP_DISABLE_PIP_VERSION_CHECK := 1

.DEFAULT_GOAL := help
.PHONY: help demo test check format lint types floors nightly serve clean

help:  ## List what can be made
	@grep -hE '^[a-z]+:.*##' $(MAKEFILE_LIST) | sed -E 's/:[^#]*## /\t/' | expand -t 12

# The stamps carry no version: make compares their age with what decides the installation.
$(VENV)/.created:
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info[:2] != (3, 11))' || \
		{ echo "found $$($(PYTHON) --version), expected Python 3.11: make PYTHON=/path/to/python3.11"; exit 2; }
	$(PYTHON) -m venv $(VENV)
	@touch $@

$(VENV)/.installed: $(VENV)/.created pyproject.toml constraints.txt
	$(BIN)/python -m pip install --quiet --constraint constraints.txt --editable .
	@touch $@

$(VENV)/.developing: $(VENV)/.installed pyproject.toml constraints.txt
	$(BIN)/python -m pip install --quiet --constraint constraints.txt --editable '.[dev]'
	@touch $@

demo: $(VENV)/.installed  ## A simulated fleet's night, from its logs to a judged policy and a report
	$(BIN)/ses demo

nightly: $(VENV)/.installed  ## A night over your own logs: make nightly INBOX=dir
	$(BIN)/ses nightly --inbox $(INBOX)

serve: $(VENV)/.installed  ## Server, worker and schedule on this machine
	$(BIN)/ses serve

test: $(VENV)/.developing  ## The default test suite
	$(BIN)/python -m pytest

check: $(VENV)/.developing lint types floors test  ## What CI runs: format, lint, types, import floors, tests

format: $(VENV)/.developing  ## Rewrite the sources the way `check` wants them
	$(BIN)/ruff format .
	$(BIN)/ruff check --fix .

lint: $(VENV)/.developing  ## Format and lint, without changing anything
	$(BIN)/ruff format --check .
	$(BIN)/ruff check .

types: $(VENV)/.developing  ## mypy --strict
	$(BIN)/mypy

floors: $(VENV)/.developing  ## Imports point down
	$(BIN)/lint-imports

clean:  ## Remove the environment and every cache; never a store
	rm -rf $(VENV) .mypy_cache .ruff_cache .pytest_cache .hypothesis *.egg-info
	find . -name __pycache__ -type d -prune -exec rm -rf {} +
