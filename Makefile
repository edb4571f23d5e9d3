# Every target works as the very first command after a clone; the environment is kept in .venv.

SHELL := /bin/bash
.DEFAULT_GOAL := help
.PHONY: help demo picture test lint bench faults wheel clean

STAMP := .venv/.stamp
BIN := .venv/bin
PACKAGES := drivers sim_drivers estimators planners runtime configs
PYTHONS := python3 python3.12 python3.11
SUPPORTED := import sys; sys.exit(not (3, 11) <= sys.version_info[:2] <= (3, 12))
export PIP_DISABLE_PIP_VERSION_CHECK := 1

help:  ## list the targets
	@echo "Trundle.  Targets (Python 3.11 or 3.12; PYTHON=/path/to/python chooses one):"
	@awk -F ':.*## ' '/^[a-z]+:.*## / {printf "  make %-6s %s\n", $$1, $$2}' $(MAKEFILE_LIST)

demo: $(STAMP)  ## drive the omni robot through the dynamic hallway and record it
	$(BIN)/trundle run dynamic_hallway

picture: $(STAMP)  ## make the README's pictures (needs a Vulkan driver; a software one will do)
	$(BIN)/trundle run dynamic_hallway --seed 1 --log runs/picture.rrd --force
	$(BIN)/trundle review runs/picture.rrd --at 212 --screenshot docs/dynamic_hallway.png
	$(BIN)/trundle run dynamic_hallway --seed 1 --realtime --set loop.rate_hz=40 --log runs/late.rrd --force
	$(BIN)/trundle review runs/late.rrd --at 300 --question late --screenshot docs/why_late.png
	$(BIN)/trundle run dynamic_hallway --seed 1 --set planner.name=point_ds --log runs/recorded.rrd --force
	$(BIN)/trundle replay runs/recorded.rrd --planner dwa --log runs/counterfactual.rrd --force || [ $$? -eq 1 ]
	$(BIN)/trundle review runs/counterfactual.rrd --at 216 --screenshot docs/counterfactual.png
	$(BIN)/trundle run dynamic_bottleneck --seed 4 --set planner.name=dwa --log runs/trap.rrd --force || [ $$? -eq 1 ]
	$(BIN)/trundle review runs/trap.rrd --at 346 --screenshot docs/trap.png
	$(BIN)/trundle run dynamic_bottleneck --seed 4 --set planner.name=rcsp --log runs/waiting.rrd --force
	$(BIN)/trundle review runs/waiting.rrd --at 140 --screenshot docs/waiting.png

# The tests of a file run in one process: they share the kernels that the first of them compiles.
test: lint  ## what CI runs: format, lint, types, layers, tests
	$(BIN)/python -m pytest -n 2 --dist loadfile

lint: $(STAMP)  ## format, lint, types and layer contracts only
	$(BIN)/ruff format --check .
	$(BIN)/ruff check .
	$(BIN)/mypy
	$(BIN)/lint-imports

bench: $(STAMP)  ## measure every figure beside its budget and its peer (ARGS=pacer for some)
	$(BIN)/python -m tests.benchmarks.run $(ARGS)

faults: $(STAMP)  ## let devices misbehave by script and print who answered what, how soon (ARGS=can for some)
	$(BIN)/python -m tests.faults.campaign $(ARGS)

wheel: $(STAMP)  ## build the wheel into dist/
	rm -rf build
	$(BIN)/python -m pip wheel --quiet --no-deps --wheel-dir dist .
	@ls dist/*.whl

clean:  ## remove the environment and everything built
	rm -rf .venv build dist *.egg-info .mypy_cache .ruff_cache .pytest_cache .hypothesis .import_linter_cache
	find $(PACKAGES) tests -name __pycache__ -prune -exec rm -rf {} +

# A venv that another Python made is made anew; otherwise pip brings it up to the pins in place.
$(STAMP): pyproject.toml constraints.txt
	@set -eu; \
	if ! $(BIN)/python -c '$(SUPPORTED)' 2>/dev/null; then \
	  python=; \
	  for candidate in $(or $(PYTHON),$(PYTHONS)); do \
	    if "$$candidate" -c '$(SUPPORTED)' 2>/dev/null; then python=$$candidate; break; fi; \
	  done; \
	  if [ -z "$$python" ]; then \
	    echo "Trundle needs Python 3.11 or 3.12 and found neither as: $(or $(PYTHON),$(PYTHONS)).  Set PYTHON=/path/to/it." >&2; \
	    exit 1; \
	  fi; \
	  "$$python" -m venv --clear .venv; \
	fi; \
	echo "Installing Trundle and its tools into .venv (the first time takes a few minutes)"; \
	$(BIN)/python -m pip install --quiet --constraint constraints.txt --editable '.[dev]'; \
	touch $@
