PYTHON ?= python3
VENV := .venv
RUN := $(VENV)/bin/python
# One file says what is installed, so that a second `make` finds nothing to do.
READY := $(VENV)/.installed

.PHONY: setup demo test durations bench lint installed notebooks workbench clean

setup: $(READY)

$(READY): pyproject.toml constraints.txt
	test -x $(RUN) || $(PYTHON) -m venv $(VENV)
	$(RUN) -m pip install --quiet -c constraints.txt torch
	$(RUN) -m pip install --quiet -c constraints.txt -e ".[workbench,test]"
	touch $@

demo: setup
	$(RUN) train.py model=continuum train=sample3

lint: setup
	$(VENV)/bin/ruff check .
	$(VENV)/bin/ruff format --check .
	$(VENV)/bin/mypy
	$(VENV)/bin/lint-imports --no-cache
	$(VENV)/bin/codespell freelearn experiments tests docs conf *.py *.md

test: setup
	$(RUN) -m pytest -n auto --dist worksteal

# How long each test takes, so that the longest begin first.
durations: setup
	$(RUN) -m pytest -n auto --dist worksteal --record-durations

# The wheel, built and run in an empty folder of a fresh environment.
installed: setup
	.ci/installed $(PYTHON)

# The documentation's notebooks, with what they show.
notebooks: setup
	$(VENV)/bin/jupyter-execute --inplace docs/*.ipynb

workbench: setup
	$(RUN) -m freelearn.workbench

bench: setup
	$(RUN) experiments/benchmark

clean:
	rm -rf $(VENV) dist
