PYTHON ?= python3
VENV := .venv
RUN := $(VENV)/bin/python
# One file says what is installed, so that a second `make` finds nothing to do. Python compiles what it imports as it
# goes, a small part of what is installed.
READY := $(VENV)/.installed
INSTALL := $(RUN) -m pip install -qq --no-compile -c constraints.txt
# What Python has compiled is kept, whatever the environment says: else each process compiles all that it imports again.
unexport PYTHONDONTWRITEBYTECODE

.PHONY: help setup demo test nightly attack durations bench lint installed audit sbom notebooks pictures docs workbench clean

setup: $(READY)

# What can be made.
help:
	@echo "make WHAT, where WHAT is"
	@awk '/^# /{about = substr($$0, 3)} /^[a-z]+:( |$$)/{split($$1, name, ":"); if (about) printf "  %-10s %s\n", name[1], about} !/^# /{about = ""}' Makefile
	@echo "freelearn --help names the commands (.venv/bin/freelearn)."

# The newest pip finds what fits together in half the time of the one that Python brings.
$(READY): pyproject.toml constraints.txt
	test -x $(RUN) || $(PYTHON) -m venv $(VENV)
	$(RUN) -m pip install -qq --upgrade pip
	$(INSTALL) torch
	$(INSTALL) -e ".[workbench,test]"
	touch $@

# A hidden effect explained, a real muscle, and a plain fit.
demo: setup
	$(RUN) discover.py data.hidden=random data.seed=7 train=sample3 hydra.run.dir=outputs/story
	$(RUN) discover.py data=dmsp20 train=all effects=[fiber_misalignment] ruled_out=[force_gain,pressure_gain] hydra.run.dir=outputs/muscle
	$(RUN) train.py model=continuum train=sample3

# Style, types, imports and spelling.
lint: setup
	$(VENV)/bin/ruff check .
	$(VENV)/bin/ruff format --check .
	$(VENV)/bin/mypy
	$(VENV)/bin/lint-imports --no-cache
	$(VENV)/bin/codespell freelearn experiments tests docs conf *.py *.md

# A file of tests stays on one worker, which keeps what its tests share; the longest files begin first.
PYTEST := $(RUN) -m pytest -n auto --dist loadfile --no-loadscope-reorder

# All tests.
test: setup
	$(PYTEST)

# All tests: every seed, bed, launcher, notebook and attack of which `make test` takes a sample; the wheel, the audit.
nightly: setup
	FREELEARN_TESTS=all $(PYTEST)
	$(MAKE) installed audit

# Every attack of tests/attack alone.
attack: setup
	FREELEARN_TESTS=all $(PYTEST) tests/attack

# How long each file of tests takes, so that the longest begin first.
durations: setup
	$(PYTEST) --record-durations

# The wheel, built and run in an empty folder of a fresh environment.
installed:
	.ci/installed $(PYTHON)

# Known vulnerabilities of the packages that are used.
audit: setup
	.ci/audit

# What a release consists of, as dist/freelearn-VERSION.cdx.json (CycloneDX).
sbom: setup
	.ci/sbom $(PYTHON)

# The documentation's notebooks, with what they show.
notebooks: setup
	$(VENV)/bin/jupyter-execute --inplace docs/*.ipynb

# The pictures of README and docs but those of measured data (python experiments/pictures.py --help) and benchmarks.
pictures: setup
	$(RUN) experiments/pictures.py
	$(RUN) experiments/effect_gallery.py

# The documentation as a site, outputs/site/index.html. A warning, a page that no other names among them, is an error.
docs: setup
	$(INSTALL) -e ".[docs]"
	$(RUN) -m sphinx -W --keep-going -q -b html docs outputs/site
	@echo "site: outputs/site/index.html"

# The whole loop with the mouse, on a page of this machine.
workbench: setup
	$(RUN) -m freelearn.workbench

# Every speed beside its peer. SysIdentPy is a peer alone, and holds NumPy back (0.9: below 2.4) without a need for it.
bench: setup
	$(INSTALL) --no-deps sysidentpy==0.9.0
	$(RUN) experiments/benchmark

# Removes .venv and dist; old outputs go by `freelearn clean`.
clean:
	rm -rf $(VENV) dist
