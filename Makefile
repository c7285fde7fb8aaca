# Every step of the project; `make` alone lists them.
# All paths are relative, so that the folder's own name may hold spaces.

SHELL := /bin/sh
PYTHON ?= python3
BIN := .venv/bin
LOCK := requirements/lock.txt
STAMP := .venv/.made-in
# intervals.py takes an hour and a half, scale.py is `make scale`
SPEEDS := workflow measure logs bags kernel robot space

# An environment knows the folder it was made in: it is made again where the folder was moved.
MOVED := $(shell [ -x $(BIN)/python ] && [ "$$(cat $(STAMP) 2>/dev/null)" = "$$(pwd -P)" ] || echo yes)

.DEFAULT_GOAL := help
.DELETE_ON_ERROR:
.PHONY: help env run sweep docs test pages lint gallery fuzz accessible mutants killed fulldisk samebytes matrix strokes curved reliability mutations reallogs cluster scale disturbed benchmark lock clean FORCE

help: ## show this list
	@awk -F ':.*## ' '/^[a-z]+:.*## / { printf "  make %-10s %s\n", $$1, $$2 }' Makefile
	@echo
	@echo "  PYTHON=python3.12 chooses another Python for .venv; ARGS=... goes to run, test and lock."

env: $(STAMP) ## make the environment in .venv from the hash-locked requirements
	@$(BIN)/python -m compileall -q src

$(STAMP): $(LOCK) pyproject.toml $(if $(MOVED),FORCE)
	@command -v "$(PYTHON)" >/dev/null || { \
	  echo "There is no '$(PYTHON)' here. rftfit needs Python 3.11 or newer; name yours with"; \
	  echo "  make $(MAKECMDGOALS) PYTHON=python3.12"; exit 1; } >&2
	@"$(PYTHON)" -c 'import sys; sys.exit(sys.version_info < (3, 11))' || { \
	  echo "rftfit needs Python 3.11 or newer, but '$(PYTHON)' is $$("$(PYTHON)" --version 2>&1). Name a newer one with"; \
	  echo "  make $(MAKECMDGOALS) PYTHON=python3.12"; exit 1; } >&2
	@"$(PYTHON)" -m venv $(if $(MOVED),--clear) .venv || { \
	  echo "'$(PYTHON)' cannot make a virtual environment. On Debian and Ubuntu: apt-get install python3-venv"; exit 1; } >&2
	@echo "Installing the locked packages into .venv; this takes a minute or two, once ..."
	@$(BIN)/python -m pip install --quiet --disable-pip-version-check --no-compile --use-pep517 --require-hashes -r $(LOCK)
	@$(BIN)/python -m compileall -q -j 0 -x '/tests?/' .venv/lib # on all processors, of which pip uses one
	@$(BIN)/python -m pip install --quiet --disable-pip-version-check --no-deps --no-build-isolation -e .
	@pwd -P > $(STAMP)

run: env ## write the demonstration campaign if it is not there, then run the whole workflow
	@$(BIN)/rftfit reenact --if-missing
	@$(BIN)/rftfit run $(ARGS)

sweep: env ## run the paper's whole sweep of the robot; stop it at will, it goes on from there
	@$(BIN)/rftfit reenact --if-missing
	@$(BIN)/rftfit sweep $(ARGS)

test: env ## run the tests
	@$(BIN)/python -m pytest -n 2 --dist loadfile --no-loadscope-reorder -m "not page" $(ARGS)

pages: env ## follow every page of the documentation, command by command
	@$(BIN)/python -m pytest -n 2 -m page $(ARGS)

lint: env ## check style, types, the workflow and the shape of the project
	$(BIN)/ruff check
	$(BIN)/ruff format --check
	$(BIN)/snakefmt --check Snakefile workflow
	$(BIN)/mypy
	@$(BIN)/rftfit reenact --if-missing # the workflow is read with its campaign in place
	$(BIN)/snakemake --lint
	$(BIN)/sp-repo-review .

fuzz: env ## feed random and damaged bytes to every reader of text, ten minutes each
	@$(BIN)/python tests/fuzz_logs.py $(ARGS)

mutants: env ## change the physics in small ways and see whether a test notices, forty minutes
	@[ -f .mutants/tool/made ] || { $(BIN)/python -m pip install --quiet --disable-pip-version-check \
	  --no-deps --require-hashes --target .mutants/tool -r requirements/mutation.txt && touch .mutants/tool/made; }
	@PYTHONPATH=.mutants/tool $(BIN)/python tests/mutants/run.py $(ARGS)

killed: env ## kill the workflow at twenty random moments and go on, half an hour
	@$(BIN)/python tests/slow/killed.py $(ARGS)

fulldisk: env ## run the workflow on disks that are too small or read-only and go on, ten minutes
	@$(BIN)/python tests/slow/full_disk.py $(ARGS)

samebytes: env ## run one campaign under different circumstances and compare its results, five minutes
	@$(BIN)/python tests/slow/same_bytes.py $(ARGS)

matrix: env ## run campaigns of other grids and protocols and compare them with the truth, half an hour
	@$(BIN)/python tests/slow/matrix.py $(ARGS)

reliability: env ## measure false alarms and power of the checks, coverage, and the map, by campaigns that are not kept yet, an hour
	@$(BIN)/python tests/slow/reliability.py $(ARGS)
	$(if $(ARGS),,@$(BIN)/python studies/grade_map.py --rows results/grade_map.csv --report results/grade_map.csv)

mutations: env ## compare check and run on campaigns with mistakes in sheet, config and logs, ten minutes
	@$(BIN)/python tests/slow/mutations.py $(ARGS)

reallogs: env ## run a campaign around each log of ../shared/data/logs, eight minutes
	@$(BIN)/python tests/slow/real_logs.py $(ARGS)

strokes: env ## find the strokes in 500 motions of machines and arms, a minute
	@$(BIN)/python tests/slow/strokes.py $(ARGS)

curved: env ## measure intervals of the force at stated depths where stress is curved, ten minutes
	@$(BIN)/python tests/slow/curved.py $(ARGS)

accessible: env ## look for what keeps readers of the page out, with axe-core, two minutes
	@[ -f .mutants/axe/made ] || { $(BIN)/python -m pip install --quiet --disable-pip-version-check \
	  --no-deps --require-hashes --target .mutants/axe -r requirements/axe.txt && touch .mutants/axe/made; }
	@$(BIN)/python tests/slow/accessible.py $(ARGS)

cluster: env ## run a campaign on a Slurm cluster of this machine that loses a node (root; Debian), ten minutes
	@[ "$$(id -u)" = 0 ] || { echo "make cluster needs root: Slurm's daemons start jobs." >&2; exit 1; }
	@$(BIN)/python -m pip install --quiet --disable-pip-version-check --no-deps --require-hashes \
	  -r requirements/cluster.txt
	@$(BIN)/python tests/slow/cluster.py $(ARGS)

scale: env ## measure campaigns of 1,000 to 20,000 logs, a quarter of an hour and 7 GB
	@$(BIN)/python benchmarks/scale.py $(ARGS)

disturbed: env ## measure how often intervals hold under the disturbances of a real lab, five minutes (ARGS=500: campaigns, half an hour)
	@$(BIN)/python benchmarks/disturbed.py $(ARGS)

benchmark: env ## measure the speeds that docs/performance.md states
	@for name in $(SPEEDS); do $(BIN)/python "benchmarks/$$name.py" || exit 1; done

docs: env ## build the documentation site in docs/_build
	@$(BIN)/python -m sphinx -W --keep-going -q -b html docs docs/_build/html
	@echo "docs/_build/html/index.html"

gallery: env ## make the pictures, the live report and the output of commands that docs/ shows, five minutes (ARGS=FOLDER: logs of the sand example)
	@$(BIN)/python docs/_ext/gallery.py $(ARGS)

lock: ## write requirements/lock.txt again (needs uv; ARGS=--upgrade for newer versions)
	@command -v uv >/dev/null || { echo "make lock needs the program uv." >&2; exit 1; }
	uv pip compile --quiet --universal --generate-hashes --no-emit-index-url --python-version 3.11 \
	  --group dev pyproject.toml -o $(LOCK) --no-header $(ARGS)

clean: ## delete all results and caches; raw logs and .venv stay
	rm -rf results .snakemake .mutants .pytest_cache .mypy_cache .ruff_cache .hypothesis .coverage dist build
	find src tests benchmarks studies -name __pycache__ -type d -prune -exec rm -rf {} +
