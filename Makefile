# One command each: `make all` redoes the paper, `make test` tests the code. `make help` lists the rest.

PYTHON ?= python3
CORES ?= all

VENV := .venv
STAMP := $(VENV)/.complete
BIN := $(CURDIR)/$(VENV)/bin
# What a rule's `script:` or `shell:` finds first must be the locked environment.
IN_VENV := PATH="$(BIN):$$PATH"
SNAKEMAKE = $(IN_VENV) snakemake
COMPILE := from stripfold import kernels; kernels.load()
# Compiled beside each other before the rest.
SLOWEST := film.line_kernels kernels.step

# The systems solved are small and banded: threads inside BLAS only cost time, the parallelism is between runs.
export OMP_NUM_THREADS := 1
export OPENBLAS_NUM_THREADS := 1
export MPLBACKEND := Agg
# Nothing from outside the environment may be imported.
export PYTHONNOUSERSITE := 1
unexport PYTHONPATH PYTHONHOME VIRTUAL_ENV
# Compiled modules are kept: otherwise each process compiles the package, and pytest all tests, anew.
unexport PYTHONDONTWRITEBYTECODE

.DEFAULT_GOAL := help
.DELETE_ON_ERROR:
.PHONY: all release studies peers report docs test wheels starts lint quick unlock env lock clean help

all: $(STAMP) ## Redo the paper and its verification, at a reader's scale, beside the release's numbers (CORES=n)
	$(SNAKEMAKE) all --cores $(CORES)

RELEASE := --configfile workflow/config/paper.yaml workflow/config/release.yaml
release: $(STAMP) ## The same at full scale (an hour and a half on two cores, idle machine), and the tables of README and docs
	$(SNAKEMAKE) all release $(RELEASE) --cores $(CORES)

studies: $(STAMP) ## Redo the verification studies alone
	$(SNAKEMAKE) studies --cores $(CORES)

# Other programs, in an environment of their own beside ours. AUTO-07p is Debian's: apt-get install auto-07p gfortran.
PEERS := verification/peers
peers: $(STAMP) $(PEERS)/.venv/.complete ## Install the other programs that a release is compared with

$(PEERS)/.venv/.complete: $(PEERS)/requirements.lock
	rm -rf $(PEERS)/.venv
	$(PYTHON) -m venv $(PEERS)/.venv
	$(PEERS)/.venv/bin/python -m pip install --quiet --require-hashes -r $(PEERS)/requirements.lock
	@touch $@

report: $(STAMP) ## Put all figures with their captions and all numbers into one page, report.html
	$(SNAKEMAKE) --report report.html

# The generator reads the sources without importing them: it needs nothing of the project's own environment.
DOCS := .venv-docs
docs: $(DOCS)/.complete ## Build the documentation into site/; a broken link is an error
	NO_MKDOCS_2_WARNING=1 $(DOCS)/bin/mkdocs build --strict
	@echo "open site/index.html"

$(DOCS)/.complete: docs/requirements.lock
	rm -rf $(DOCS)
	$(PYTHON) -m venv $(DOCS)
	$(INSTALL_DOCS) --quiet --require-hashes --no-deps -r docs/requirements.lock
	@touch $@

test: $(STAMP) ## Run the tests (set PYTEST_ARGS="-k fold" to choose, "-m slow" for the slow ones)
	@$(IN_VENV) python -c '$(COMPILE)'
	$(IN_VENV) python -m pytest --numprocesses $(CORES:all=auto) --dist loadfile $(PYTEST_ARGS)

wheels: $(STAMP) ## Run all commands by the wheel, with the lowest and the newest versions (ten minutes, network)
	$(IN_VENV) python packaging/check_wheel.py

starts: $(STAMP) ## Compute what is stored with the package anew
	$(IN_VENV) python workflow/starts.py

# Into a folder of its own, so that it neither uses nor touches what `make all` stored. Kept when the run fails.
quick: $(STAMP) ## Run the chain small, in minutes, into a temporary folder, without the longest studies
	@out=$$(mktemp -d "$${TMPDIR:-/tmp}/stripfold-quick.XXXXXX") || exit 1; \
	trap 'exit 130' INT; trap 'exit 143' TERM; \
	echo "quick run into $$out"; \
	if $(SNAKEMAKE) all --cores $(CORES) --show-failed-logs \
	    --configfile workflow/config/quick.yaml \
	    --config results="$$out/results" figures="$$out/figures"; \
	then rm -rf "$$out"; \
	else status=$$?; echo "quick run failed; what it wrote is kept in $$out" >&2; exit $$status; fi

# All of `snakemake --lint` but one check: see docs/architecture.md.
define SNAKEMAKE_LINT
from snakemake.cli import main
from snakemake.linting.rules import RuleLinter
del RuleLinter.lint_missing_software_definition
main(['--lint'])
endef
export SNAKEMAKE_LINT

unlock: $(STAMP) ## Remove the lock of a run that was killed
	$(SNAKEMAKE) --unlock

lint: $(STAMP) ## Check style, formatting, types and the workflow
	$(IN_VENV) ruff check
	$(IN_VENV) ruff format --check
	$(IN_VENV) mypy
	$(IN_VENV) snakefmt --check Snakefile workflow
	$(IN_VENV) python -c "$$SNAKEMAKE_LINT"

env: $(STAMP) ## Make the environment in .venv from environment.lock

# The stamp is written last and removed first: an interrupted installation is never taken for a whole one.
# While the lock is unchanged only the project itself is installed again. Its kernels are compiled here, once: the first
# processes of a run would each do so.
$(STAMP): environment.lock pyproject.toml
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11))' || { \
	    echo "stripfold needs Python 3.11 or newer, but '$(PYTHON)' is: $$($(PYTHON) --version 2>&1)." >&2; \
	    echo "Name another one: make PYTHON=python3.12 $(MAKECMDGOALS)" >&2; exit 1; }
	@$(PYTHON) -c 'import ensurepip, venv' 2>/dev/null || { \
	    echo "'$(PYTHON)' cannot make virtual environments: its module venv or ensurepip is missing." >&2; \
	    echo "On Debian: apt-get install python3-venv" >&2; exit 1; }
	@rm -f $@
	@cmp -s environment.lock $(VENV)/environment.lock || rm -rf $(VENV)
	@test -d $(VENV) || $(MAKE) --no-print-directory -f $(firstword $(MAKEFILE_LIST)) locked-packages
	$(VENV)/bin/python -m pip install --quiet --no-deps --no-build-isolation --editable .
	@for module in $(SLOWEST); do $(VENV)/bin/python -c "import stripfold.$$module" & done; wait
	$(VENV)/bin/python -c '$(COMPILE)'
	@touch $@
	@echo "environment complete: $(VENV), $$($(VENV)/bin/python --version)"

# The build tools come first, from the lock like the rest: one dependency is published as source only, and pip
# would otherwise fetch unpinned tools to build it.
# Modules are compiled to byte code when they are first imported: most never are. The checks install with uv, which is
# faster; pip knows the package index that a user has configured.
INSTALL = $(VENV)/bin/python -m pip install --no-compile
INSTALL_DOCS = $(DOCS)/bin/python -m pip install --no-compile
.PHONY: locked-packages
locked-packages:
	$(PYTHON) -m venv $(VENV)
	awk '/^[^ ]/ { keep = /^(packaging|setuptools|wheel)==/ } keep' environment.lock > $(VENV)/build-tools.lock
	$(INSTALL) --quiet --require-hashes --no-deps -r $(VENV)/build-tools.lock
	$(INSTALL) --quiet --require-hashes --no-build-isolation -r environment.lock
	cp environment.lock $(VENV)/environment.lock

# Pins already in the lock are kept where they still fit. To move to newest versions: make lock LOCK_ARGS=--upgrade
UV_VERSION := 0.13.8
lock: ## Bring all locks in line with what they are made from (LOCK_ARGS=--upgrade for newer versions)
	@tmp=$$(mktemp -d) && trap 'rm -rf "$$tmp"' EXIT && set -e && \
	$(PYTHON) -m venv "$$tmp" && \
	"$$tmp/bin/python" -m pip install --quiet uv==$(UV_VERSION) && \
	compile() { env -u UV_FIND_LINKS -u UV_INDEX -u UV_EXTRA_INDEX_URL "$$tmp/bin/uv" pip compile --quiet --no-config \
	    --universal --python-version 3.11 --generate-hashes \
	    --no-annotate --no-emit-index-url --no-emit-find-links --custom-compile-command "make lock" \
	    $(LOCK_ARGS) "$$@"; } && \
	compile --extra dev --output-file environment.lock pyproject.toml && \
	compile --output-file $(PEERS)/requirements.lock $(PEERS)/requirements.in && \
	compile --group docs --output-file docs/requirements.lock

clean: ## Remove the environments and the tools' caches (results and figures are kept)
	rm -rf $(VENV) $(PEERS)/.venv $(DOCS) site build dist src/*.egg-info .mypy_cache .pytest_cache .ruff_cache
	find src tests verification workflow -type d -name __pycache__ -prune -exec rm -rf {} + 2>/dev/null || true

help: ## Show this list
	@awk -F ':.*## ' '/^[a-z-]+:.*## / { printf "  make %-7s %s\n", $$1, $$2 }' $(firstword $(MAKEFILE_LIST))
