# Everything a fresh machine needs is Python 3.11+ and make.
PYTHON ?= $(shell for p in python3.13 python3.12 python3.11 python3; do command -v $$p >/dev/null 2>&1 && $$p -c 'import sys, venv, ensurepip; sys.exit(sys.version_info < (3, 11))' >/dev/null 2>&1 && { echo $$p; break; }; done)
VENV ?= .venv
BIN := $(VENV)/bin
# Where the environment forbids bytecode, each service that a test starts would compile its source anew.
export PYTHONDONTWRITEBYTECODE =
export OMP_NUM_THREADS = 1
export OPENBLAS_NUM_THREADS = 1
export MKL_NUM_THREADS = 1

.PHONY: help docs demo clients client-types test lint types layers kernels unit serve long faults bench experiments peers load mutants fuzz page pictures wheel image-check sbom audit lock clean

help:  ## list the targets
	@grep -E '^[a-z-]+:.*##' $(MAKEFILE_LIST) | sed -E 's/:.*## /\t/' | expand -t 12

PIP := $(BIN)/python -m pip install --quiet --disable-pip-version-check --no-compile

# What the demo and the service run with. The pip that Python brings takes twice as long as the one that is named there.
$(VENV)/.runs: requirements/demo.txt
	@test -n "$(PYTHON)" || { echo "Python 3.11 or newer with venv is needed (Debian: apt-get install python3-venv)"; exit 1; }
	$(PYTHON) -m venv $(VENV)
	$(PIP) $(shell grep ^pip== requirements/dev.txt)
	$(PIP) -r requirements/demo.txt
	@touch $@

$(VENV)/.ready: $(VENV)/.runs pyproject.toml requirements/dev.txt
	$(PIP) -r requirements/dev.txt
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --no-deps --no-build-isolation -e . -e clients/python
	@touch $@

demo: $(VENV)/.runs  ## start the service, ask it where a robot is, draw the answer
	$(BIN)/python -m examples.demo

test: lint layers  ## lint, import layers, types and tests, these in three processes or as JOBS= says
	$(MAKE) --no-print-directory -j 2 types unit

lint: $(VENV)/.ready
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .

types: $(VENV)/.ready
	$(BIN)/mypy

layers: $(VENV)/.ready
	$(BIN)/lint-imports

# Kernels before tests: the processes would compile the same ones side by side.
kernels: $(VENV)/.ready
	$(BIN)/python -c "from linefix.compiling import compile_kernels; compile_kernels()"

JOBS ?= 3  # tests of the service wait as much as they work

unit: kernels
	$(BIN)/python -m pytest -m "not long" -n $(JOBS) --dist loadfile --no-loadscope-reorder

serve: $(VENV)/.ready  ## run the service on 127.0.0.1:8000, or as ARGS="--port 8001" says
	$(BIN)/python -m service $(ARGS)

long: $(VENV)/.ready  ## the long forms of the other tests (5 to 7 min)
	$(BIN)/python -m pytest -m long --ignore tests/faults -n 2 --dist loadfile

faults: $(VENV)/.ready  ## kill, fill, flip, drain and load for hours: the long forms of tests/faults
	$(BIN)/python -m pytest -s -m long tests/faults --soak-minutes $(or $(MINUTES),30)

bench: $(VENV)/.ready  ## print the table of quality and speed
	$(BIN)/python -m benchmarks

load: $(VENV)/.ready  ## print what ten times too much load does, and what large maps do meanwhile (5 min)
	$(BIN)/python -m benchmarks load

mutants: $(VENV)/.ready  ## change the code in 600 places, one at a time, and report which changes the tests notice (hours; continues a stopped run)
	nice -n 19 $(BIN)/python -m benchmarks.mutants $(ARGS)

docs: $(VENV)/.ready requirements/docs.txt  ## build the documents as pages, into out/docs
	$(BIN)/python -m pip install --quiet --disable-pip-version-check -r requirements/docs.txt
	$(BIN)/python -m sphinx -W --keep-going -q -b html docs out/docs

$(VENV)-clients/.ready: $(VENV)/.ready
	$(BIN)/python -m venv $(VENV)-clients
	$(VENV)-clients/bin/python -m pip install --quiet --disable-pip-version-check datamodel-code-generator==0.89.0 nlohmann-json==3.12.0 openapi-python-client==0.29.1
	@touch $@

client-types: $(VENV)-clients/.ready  ## make the types of clients/python anew from the schema
	$(BIN)/python -m clients.types $(VENV)-clients/bin/datamodel-codegen
	-$(BIN)/ruff format --quiet clients/python

clients: $(VENV)-clients/.ready  ## make clients by generators for Python, TypeScript and C++, and ask the README's question with each
	$(BIN)/python -m clients.trial $(VENV)-clients/bin

fuzz: $(VENV)/.ready  ## send 100,000 strange requests
	FUZZ_CASES=100000 $(BIN)/python -m pytest -s tests/service/http/test_fuzz.py

experiments: $(VENV)/.ready  ## the paper's tables and figures, into out/experiments
	$(BIN)/python -m experiments

$(VENV)-peers/.peers: requirements/peers.txt
	$(MAKE) VENV=$(VENV)-peers $(VENV)-peers/.ready
	$(VENV)-peers/bin/python -m pip install --quiet --disable-pip-version-check -r requirements/peers.txt
	@touch $@

peers: $(VENV)-peers/.peers  ## print Linefix beside other solvers, installed apart from the rest
	$(VENV)-peers/bin/python -m benchmarks peers

page: $(VENV)/.ready  ## make the page's types from the schema, and build it from web/ into service/page/ (needs node)
	cd web && npm ci --no-audit --no-fund
	$(BIN)/python -m clients.types | npm --prefix web run --silent contract
	cd web && npm run build
	$(BIN)/python -m examples.scenes

pictures: $(VENV)/.ready  ## draw the pictures of README and documents that need no data; the page with chromium
	$(BIN)/python -m examples.animation
	$(BIN)/python -m examples.concepts
	$(BIN)/python -m examples.several_maps
	$(BIN)/python -m examples.changed_building
	$(BIN)/python -m examples.changed_page
	$(BIN)/python -m examples.verdicts
	$(BIN)/python -m examples.demo && cp out/demo.png docs/demo.png

wheel: $(VENV)/.ready  ## build the wheel of the last commit into dist/, twice: both have to be the same to the byte
	BIN=$(BIN) .ci/wheel

image-check: $(VENV)/.ready  ## look into a built image and run it without rights: ARCHIVE=image.tar, of `docker save`; as root
	$(BIN)/python .ci/image.py $(ARCHIVE)

sbom: $(VENV)/.ready  ## write the bill of materials (CycloneDX) and list the licences; no GPL passes
	$(BIN)/python .ci/materials.py

audit: $(VENV)/.ready  ## look the pinned packages up in the published advisories; fails where there are none to be had
	BIN=$(BIN) .ci/audit

PIN := -m uv pip compile --quiet --universal --python-version 3.11 --no-emit-index-url --no-annotate --no-header

lock: $(VENV)/.ready  ## pin the dependencies anew, by hash where the image is made of them
	$(BIN)/python $(PIN) --generate-hashes --extra formats --extra service pyproject.toml requirements/image.in -o requirements/runtime.txt
	$(BIN)/python $(PIN) --extra service --extra formats --extra batch --extra ray --extra ros2 --group dev pyproject.toml -o requirements/dev.txt
	$(BIN)/python $(PIN) --generate-hashes -c requirements/dev.txt --group build -o requirements/build.txt
	$(BIN)/python $(PIN) -c requirements/dev.txt --extra service --extra formats --group demo pyproject.toml -o requirements/demo.txt
	$(BIN)/python $(PIN) -c requirements/dev.txt --group peers -o requirements/peers.txt
	$(BIN)/python $(PIN) -c requirements/dev.txt --group docs -o requirements/docs.txt

# A directory that LINEFIX_KERNELS names stays: it may hold other things.
clean:  ## remove what the other targets made, compiled kernels too
	rm -rf $(VENV) $(VENV)-peers $(VENV)-clients out build dist .mypy_cache .ruff_cache .pytest_cache .hypothesis .import_linter_cache
	find . -name __pycache__ -type d -prune -exec rm -rf {} +
	rm -rf "$${XDG_CACHE_HOME:-$${HOME:-/nonexistent}/.cache}/linefix/kernels"
