# Everything runs in .venv, made here from the hashed lock file.
PYTHON ?= python3
VENV := .venv
STAMP := $(VENV)/.installed
COMPILED := $(VENV)/.compiled
# what decides which kernels there are, and with which types they are called
SOURCES := $(shell find cdpr_rt drivers profiles sim_bus tools/composition tools/host/kernels.py -name "*.py")
BIN := $(VENV)/bin
# two more than there are cores: some tests wait for time-outs
JOBS ?= $(shell expr $$(nproc) + 2)
SOAK_MINUTES ?= 10
# the others run at the end: a busy machine would delay a browser, or change what they measure
WHICH ?= not alone and not browser

.PHONY: demo test test-all tests soak check docs page lock clean

demo: $(STAMP)  ## commission one simulated winch on the embedded bus
	$(BIN)/cdpr commission winch-mpp0923d --bus simbus: --out out/demo --overwrite

test: $(STAMP)  ## every check, and the tests but long ones: some minutes
	@$(MAKE) -j 2 check tests WHICH="not alone and not long"

test-all: $(STAMP)  ## every check and every test; needs nothing but Python
	@$(MAKE) -j 2 check tests WHICH="not alone and not browser"
	$(BIN)/python -m pytest -n 2 --dist loadscope -m browser tests/hil/test_*_page.py
	$(BIN)/python -m pytest -m alone $$(grep -rl "mark\.alone" tests --include="test_*.py")

tests: $(COMPILED)
	$(BIN)/python -m pytest -n $(JOBS) --max-worker-restart 0 --dist loadscope --no-loadscope-reorder -m "$(WHICH)"

soak: $(STAMP)  ## ten minutes of hours of bus time with eight drives: no leak, no lost frame
	$(BIN)/cdpr bench soak --hours 24 --wall-minutes $(SOAK_MINUTES)

check: $(STAMP)  ## formatting, lint, types, import directions
	$(BIN)/ruff format --check .
	$(BIN)/ruff check .
	$(BIN)/mypy
	$(BIN)/lint-imports

docs: $(STAMP)  ## the pages and the interfaces of the packages as a site, in build/site
	$(BIN)/mkdocs build -q --strict -d build/site

page: $(STAMP)  ## check and build the operator's page; needs Node.js 20 or later
	$(BIN)/python -m cdpr_rt.service.openapi > cdpr_rt/page/openapi.json
	cd cdpr_rt/page && npm ci --no-audit --no-fund --silent && npm run --silent types && npm run --silent check && npm run --silent build

lock:  ## resolve all versions again (maintainers)
	$(PYTHON) -m venv build/lock && build/lock/bin/pip install -q uv
	build/lock/bin/uv pip compile --universal --python-version 3.11 --extra dev --extra docs --generate-hashes \
	  --no-emit-index-url --no-emit-find-links --no-header --upgrade -o requirements.lock pyproject.toml

$(STAMP): requirements.lock pyproject.toml
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11))' || \
	  { echo "cdpr-rt needs Python 3.11 or later; name one with: make PYTHON=python3.12 ..." >&2; exit 2; }
	$(PYTHON) -m venv $(VENV)
	@echo "downloading and installing packages; this may take minutes without a message ..."
	$(BIN)/python -m pip install -q --disable-pip-version-check --no-compile --require-hashes -r requirements.lock
	@# pip would compile on one core, and what nothing here imports
	@$(BIN)/python -m compileall -qq -j 0 -x '/(ray|tests?)/' $(VENV)/lib || true
	$(BIN)/python -m pip install -q --disable-pip-version-check --no-deps --no-build-isolation -e .
	@touch $(STAMP)
	$(BIN)/cdpr doctor --compile
	@touch $(COMPILED)

$(COMPILED): $(STAMP) $(SOURCES)
	$(BIN)/cdpr doctor --compile
	@touch $(COMPILED)

clean:
	rm -rf $(VENV) build out
