# Every step of the project; `make` alone lists them.
# All paths are relative, so that the folder's own name may hold spaces.

SHELL := /bin/sh
PYTHON ?= python3
BIN := .venv/bin
LOCK := requirements/lock.txt
STAMP := .venv/.made-in
LINES_TOOL := .mutants/coverage/made
SPEEDS := workflow measure sheets logs bags kernel robot space

# An environment knows the folder it was made in: it is made again where the folder was moved.
MOVED := $(shell [ -x $(BIN)/python ] && [ "$$(cat $(STAMP) 2>/dev/null)" = "$$(pwd -P)" ] || echo yes)

.DEFAULT_GOAL := help
.DELETE_ON_ERROR:
.PHONY: help env run sweep test golden pages timegate lint docs stranger gallery lock clean release mutants statistics matrix wheel coverage slow fuzz killed fulldisk samebytes cluster largelogs accessible reliability disturbed intervals pairs mixups sound compare contacts mutations benchmark scale FORCE

#@ Every day
help: ## show this list
	@awk -F ':.*## ' '/^#@ / { printf "\n%s\n", substr($$0, 4) } /^[a-z]+:.*## / { printf "  make %-12s %s\n", $$1, $$2 }' Makefile
	@echo
	@echo "PYTHON=python3.12 chooses another Python for .venv; ARGS=... goes to the program of the step."
	@echo "Times are those of two cores."

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
	@$(BIN)/python -m pytest -n 2 --dist loadfile --no-loadscope-reorder -m "not page and not slow" $(ARGS)

golden: env ## make the golden campaigns anew, print each column that changed and rewrite it (ARGS=--check: only print), 2 min
	@$(BIN)/python tests/golden/rewrite.py $(ARGS)

stranger: env ## the tests that look for ../shared/data, in a clone that has none beside it (ARGS=--all: all tests)
	@$(BIN)/python studies/stranger.py $(ARGS)

pages: env ## follow every page of the documentation, command by command; the demonstration gives the paper's numbers; the report page in a browser
	@$(BIN)/python -m pytest -n 2 -m page $(ARGS)

timegate: env ## no rule of the workflow is slower than benchmarks/time_gate.csv, 40 s (ARGS=--rewrite: write that table anew)
	@$(BIN)/python benchmarks/time_gate.py $(ARGS)

lint: env ## check style, types, the workflow and the shape of the project
	$(BIN)/ruff check
	$(BIN)/ruff format --check
	$(BIN)/snakefmt --check Snakefile workflow
	$(BIN)/mypy
	$(BIN)/snakemake --lint --directory .test # a campaign that is in every clone
	$(BIN)/sp-repo-review .

docs: env ## build the documentation site in docs/_build, a minute
	@$(BIN)/python -m sphinx -W --keep-going -q -b html docs docs/_build/html
	@echo "docs/_build/html/index.html"

clean: ## delete all results and caches; raw logs and .venv stay
	rm -rf results .snakemake .mutants .versions .pytest_cache .mypy_cache .ruff_cache .hypothesis .coverage dist build
	find src tests benchmarks studies -name __pycache__ -type d -prune -exec rm -rf {} +

#@ Documents and packages
gallery: env ## make the pictures, the live report, the verdicts and the output of commands that docs/ shows, 10 min (ARGS=FOLDER: data of the examples)
	@$(BIN)/python docs/_ext/gallery.py $(ARGS)

lock: ## write requirements/lock.txt again (needs uv; ARGS=--upgrade for newer versions)
	@command -v uv >/dev/null || { echo "make lock needs the program uv." >&2; exit 1; }
	uv pip compile --quiet --universal --generate-hashes --no-emit-index-url --python-version 3.11 \
	  --group dev pyproject.toml -o $(LOCK) --no-header $(ARGS)

release: env ## version, dates and changelog agree before a tag (ARGS=0.2.0: write them), a second
	@$(BIN)/python studies/release.py $(ARGS)

#@ Slow: do the tests prove enough, on every version?
mutants: $(LINES_TOOL) ## the tests notice small changes of today's code, drawn by ARGS="--seed 20261128", and false columns (... --columns 40)
	@$(BIN)/python studies/mutants.py $(ARGS)

slow: env ## whole runs that are edited, killed, stopped, linked or made by other labs, 3 min
	@$(BIN)/python -m pytest -n 2 --dist loadfile -m "slow and not page" $(ARGS)

statistics: env ## tests of statistics hold with all their seeds and examples (make test takes some of them), 4 min
	@$(BIN)/python -m pytest -n 2 --dist loadfile -m statistics --all-seeds $(ARGS)

matrix: env ## the tests pass with the oldest and the newest version of every package, 20 min (ARGS="-m 'not page and not slow'": 8 min)
	@$(BIN)/python studies/versions.py $(ARGS)

wheel: env ## the built wheel works without a clone, make and git: README's commands on a small campaign, 2 min
	@$(BIN)/python studies/built_wheel.py $(ARGS)

coverage: $(LINES_TOOL) ## lines and branches that the tests run, room by room, 10 min
	@$(BIN)/python studies/covered.py $(ARGS)

$(LINES_TOOL): $(STAMP) requirements/coverage.txt
	@$(BIN)/python -m pip install --quiet --disable-pip-version-check \
	  --no-deps --require-hashes --upgrade --target $(@D) -r requirements/coverage.txt && touch $@

#@ Slow: does the program stand damage?
fuzz: env ## no random or damaged bytes crash a reader, or add a row to a text, 10 min for each of eighteen readers (ARGS="--seconds 60": a minute)
	@$(BIN)/python studies/fuzz_logs.py $(ARGS)

killed: env ## a run that is killed at twenty random moments goes on to the same bytes, half an hour
	@$(BIN)/python studies/damage.py killed $(ARGS)

fulldisk: env ## a disk that is too small or read-only gives a clear error, and the run goes on to the same bytes, 10 min
	@$(BIN)/python studies/damage.py fulldisk $(ARGS)

largelogs: env ## a log of 1 GB through run takes less memory than was said before, 5 min (ARGS="--count 200": 200 MB)
	@$(BIN)/python studies/damage.py longlog $(ARGS)

samebytes: env ## cores, locale, time zone and folder change no byte of the results, 5 min
	@$(BIN)/python studies/damage.py samebytes $(ARGS)

cluster: env ## a Slurm cluster of this machine that loses a node gives the same bytes, 10 min (root; Debian)
	@[ "$$(id -u)" = 0 ] || { echo "make cluster needs root: Slurm's daemons start jobs." >&2; exit 1; }
	@$(BIN)/python -m pip install --quiet --disable-pip-version-check --no-deps --require-hashes \
	  -r requirements/cluster.txt
	@$(BIN)/python studies/cluster.py $(ARGS)

accessible: env ## nothing on the page keeps readers out, by axe-core, 2 min
	@[ -f .mutants/axe/made ] || { $(BIN)/python -m pip install --quiet --disable-pip-version-check \
	  --no-deps --require-hashes --target .mutants/axe -r requirements/axe.txt && touch .mutants/axe/made; }
	@$(BIN)/python studies/accessible.py $(ARGS)

#@ Slow: are the numbers right? (ARGS="--count 5 --seed 7 --only WORD --rows FOLDER": studies/frame.py)
reliability: env ## false alarms of the checks and mistakes that they find; rows that studies/rows lacks, an hour (ARGS="--check 0.05": a share again)
	@$(BIN)/python studies/lab_files.py no-fault dead turned step repeat --rows studies/rows $(ARGS)

disturbed: env ## intervals hold under the disturbances of a real lab, 5 min (ARGS=500: campaigns, half an hour)
	@$(BIN)/python benchmarks/disturbed.py $(ARGS)

intervals: env ## 95 % intervals hold the truth in 2,000 campaigns, an hour and a half
	@$(BIN)/python benchmarks/intervals.py $(or $(ARGS),2000)

pairs: env ## two runs of a direction tell a wrong one, and sound campaigns pass, a minute
	@$(BIN)/python studies/slopes.py pairs $(ARGS)

mixups: env ## the verdict on campaigns with a mistake, and its cause, through files, 40 min
	@$(BIN)/python studies/lab_files.py mixups $(ARGS)

sound: env ## false alarms of all checks together in sound campaigns of ten designs, through files, 10 min
	@$(BIN)/python studies/lab_files.py sound $(ARGS)

compare: env ## two sessions of a medium are called alike, and 8 % of size and 10 % of shape are told, a minute
	@$(BIN)/python studies/compare_media.py $(ARGS)

contacts: env ## what forces on legs tell of a medium, and of the same leg elsewhere, 10 min
	@$(BIN)/python studies/contacts.py --rows results/contacts $(ARGS)

mutations: env ## check announces what run drops, on 200 campaigns with mistakes in sheet, config and logs, 10 min
	@$(BIN)/python studies/mistaken.py measured $(ARGS)

#@ Slow: how fast is it?
benchmark: env ## the speeds that docs/performance.md states, 10 min
	@for name in $(SPEEDS); do $(BIN)/python "benchmarks/$$name.py" || exit 1; done

scale: env ## time and memory of campaigns of 1,000 to 20,000 logs, a quarter of an hour and 7 GB
	@$(BIN)/python benchmarks/scale.py $(ARGS)
