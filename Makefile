# make run, make test: all that a fresh clone needs. Both install what they need into .venv first, and
# compile the core once. make build compiles it again, where its sources have changed.
# make test is for every change. make test-all plays what it leaves out: what takes long, and what is
# random with new choices. POOL_SEED=... repeats its random scenes, and PROFILE=fixed the
# examples of hypothesis; then a share of the random scenes is played (POOL_SHARE).
PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/$(if $(filter Windows_NT,$(OS)),Scripts,bin)

# the extras that tests need; without `env`, `play` or `examples` their tests are skipped
EXTRAS ?= test,sweep,cluster,env,fit,play,examples

ELSEWHERE := not browser and not docs
QUICK := not long and not slow and $(ELSEWHERE)
# The processor that is done first takes over tests from the other.
PLAY := $(BIN)/pytest -n auto --dist worksteal -q

# Tests start many processes; none of them need compile the modules again.
unexport PYTHONDONTWRITEBYTECODE

.PHONY: run build without-extras test played plain coverage test-all played-all test-browser test-pyodide lint format bench gallery handin screenshots docs linkcheck dist clean

run: $(VENV)/program-installed
	$(BIN)/pool-pymunk run report --solver time-slice --out renders/report-time-slice
	$(BIN)/pool-pymunk run report --solver pymunk --out renders/report \
		--against renders/report-time-slice
	$(BIN)/pool-pymunk run report --solver event-driven --out renders/report-exact \
		--against renders/report

# Compiled files stand beside their sources, and the one that they share at the top.
build: $(VENV)/packages
	@echo "The core is compiled, which takes one or two minutes."
	@env -u POOL_PYMUNK_PURE $(BIN)/python hatch_build.py

# Nothing but the optional parts may need the optional libraries: these tests, and the examples of all
# docstrings, run without them. What is random needs no others than elsewhere.
WITHOUT := atlas cli docs fit inputs manners own_laws many place shapes sweep weakening
without-extras: $(VENV)/installed
	$(PLAY) -m "$(QUICK) and not seeded and not hypothesis" \
		pool_pymunk $(foreach name,$(WITHOUT),$(wildcard tests/test_$(name).py tests/*/test_$(name).py))

# Lint goes on beside the tests, and where the core is not compiled yet, beside the compiler.
test: $(VENV)/packages
	$(MAKE) --jobs 2 --no-print-directory played lint

played: plain $(VENV)/installed
	$(PLAY) -m "$(QUICK)"

# The examples in the core's docstrings: compiled code has none.
plain: $(VENV)/packages
	POOL_PYMUNK_PURE=1 $(BIN)/pytest -q pool_pymunk/core

# Which lines of the core quick tests of the rooms that play it reach, as plain Python: compiled lines
# have no coverage.
PLAY_THE_CORE := core env many solvers studies world
coverage: $(VENV)/installed
	$(BIN)/python -m pip install --quiet --disable-pip-version-check coverage
	POOL_PYMUNK_PURE=1 $(BIN)/coverage run --source pool_pymunk/core \
		-m pytest -n 0 -q -m "$(QUICK)" pool_pymunk/core $(addprefix tests/,$(PLAY_THE_CORE))
	$(BIN)/coverage report --show-missing --skip-covered

test-all: export POOL_SEED ?= $(shell date +%s)
test-all: PROFILE ?= random
test-all: export POOL_SHARE ?= $(if $(filter fixed,$(PROFILE)),0.02,1)
test-all: $(VENV)/installed
	$(MAKE) --no-print-directory played-all PROFILE=$(PROFILE)

# `make test` has played what is quick and fixed.
LONGER := long or slow$(if $(filter fixed,$(PROFILE)),, or seeded or hypothesis)
played-all: $(VENV)/installed
	$(PLAY) --durations 40 -m "($(LONGER)) and $(ELSEWHERE)" --hypothesis-profile $(PROFILE)

# needs Chromium, of Debian (apt-get install chromium) or another; what the page is made of is linted, too
test-browser: $(VENV)/browser-installed
	$(BIN)/biome check .
	$(PLAY) -m browser

# The core as plain Python in Pyodide, as browsers have it; needs Node.js. The report's four shots must
# have the bits that they have here.
PYODIDE := build/pyodide
test-pyodide: $(VENV)/packages
	npm install --silent --no-audit --no-fund --prefix $(PYODIDE) pyodide@314
	$(BIN)/python tests/browser_python/report_shots.py >$(PYODIDE)/shots.json
	node tests/browser_python/play.mjs $(PYODIDE)/shots.json $(PYODIDE)/node_modules/pyodide pool_pymunk \
		"$$($(BIN)/python -c 'import mypy_extensions; print(mypy_extensions.__file__)')"

lint: $(VENV)/packages
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy

format: $(VENV)/packages
	$(BIN)/ruff check --fix .
	$(BIN)/ruff format .

bench: $(VENV)/installed
	$(BIN)/pytest tests/benchmarks --benchmark-enable --benchmark-only -p no:xdist -q

gallery: $(VENV)/installed
	$(BIN)/python docs/figures/gallery.py
	$(BIN)/pool-pymunk tradeoff report --solvers all --budget 60 --out renders/gallery
	$(BIN)/pool-pymunk sensitivity report --shot 1 --out renders/gallery
	$(BIN)/pool-pymunk stability --quick --out renders/gallery
	$(BIN)/pool-pymunk atlas report --shot 1 --ball C --out renders/gallery/atlas-report.png
	$(BIN)/pool-pymunk atlas eight-ball --ball cue --angle -8:8 --speed 2:10 --size 660x440 \
		--out renders/gallery/atlas-eight-ball.png
	$(BIN)/python examples/find_a_shot.py --out renders/gallery

# the report's film by its own algorithm, its figures and its table of ends, in renders/handin; of
# shots of your own: make handin SCENARIO=mine.toml
handin: $(VENV)/program-installed
	$(BIN)/python docs/figures/hand_in.py $(SCENARIO)

# pictures of the page in a browser, for the gallery
screenshots: $(VENV)/browser-installed
	$(BIN)/python docs/figures/screenshots.py

# a warning is an error
docs: $(VENV)/docs-installed
	$(BIN)/sphinx-build -W --keep-going -b html docs docs/_build

# links to other pages and to files; other hosts may be out of reach, and examples do not run again
linkcheck: docs
	$(BIN)/sphinx-build -W --keep-going -D plot_gallery=0 -b linkcheck docs docs/_build/linkcheck

$(VENV)/browser-installed: $(VENV)/installed
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --editable '.[browser,play]'
	touch $@

$(VENV)/docs-installed: pyproject.toml hatch_build.py
	@$(SAY)
	test -x $(BIN)/python || $(PYTHON) -m venv $(VENV)
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --editable '.[docs]'
	touch $@

# pip says nothing while it works.
SAY = echo "pool-pymunk is installed in $(VENV), and its core compiled if it is not yet: one to two minutes."

# the program alone, without what its optional parts and the tests need
$(VENV)/program-installed: pyproject.toml hatch_build.py
	@$(SAY)
	$(PYTHON) -m venv $(VENV)
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --editable .
	touch $@

# all at once where nothing is there yet
$(VENV)/packages: pyproject.toml hatch_build.py
	@echo "What tests and optional parts need is installed in $(VENV), which takes about a minute."
	test -x $(BIN)/python || $(PYTHON) -m venv $(VENV)
	POOL_PYMUNK_LATER=1 $(BIN)/python -m pip install --quiet --disable-pip-version-check --editable '.[$(EXTRAS)]'
	touch $@

# Without a compiler the core is plain Python.
$(VENV)/installed: $(VENV)/packages
	@echo "The core is compiled if it is not yet, which takes one or two minutes."
	-test "$$POOL_PYMUNK_PURE" = 1 || $(BIN)/python hatch_build.py
	touch $(VENV)/program-installed $@

# a source distribution, and two wheels, one of plain Python; with each of these Pythons, in an
# environment of its own in an empty folder, each of them runs README's commands and its lines of Python
# (the compiled wheel with the Python that has made it), and then the last one, which is compiled where
# there is a compiler, passes the quick tests that the source distribution has
PYTHONS ?= $(PYTHON)
TRIED := env/$(notdir $(BIN))
define TRY
	pool-pymunk run report --solver time-slice >run.log
	test -s renders/report/shot-4-end.png
	test -s "$$(pool-pymunk check report | sed -n 's/^  file: //p')"
	pool-pymunk render eight-ball --no-films
	test -s renders/eight-ball/shot-1-end.png
	pool-pymunk page report --overlay pymunk-builtin --out page.html
	test -s page.html
	sed -n '/^```python/,/^```/p' "$(CURDIR)/README.md" | grep -v '^```' | python -
	test -s follow.png
endef
define BUILT
import sys, pool_pymunk
print("The core is", "compiled." if pool_pymunk.compiled else "plain Python.")
wheel = sys.argv[1]
sys.exit(wheel.endswith("-any.whl") and pool_pymunk.compiled or "-cp" in wheel and not pool_pymunk.compiled)
endef
export TRY BUILT
dist: export PIP_QUIET := 1
dist: export PIP_DISABLE_PIP_VERSION_CHECK := 1
dist: $(VENV)/installed
	rm -rf dist build
	$(BIN)/python -m pip install build
	$(BIN)/python -m build --outdir dist .
	POOL_PYMUNK_PURE=1 $(BIN)/python -m build --wheel --outdir dist .
	mkdir -p build/source && tar xzf dist/*.tar.gz -C build/source --strip-components 1
	set -e; empty=$$(mktemp -d); trap 'rm -rf "$$empty"' EXIT; cd "$$empty"; \
	for python in $(PYTHONS); do for file in "$(CURDIR)"/dist/*.tar.gz "$(CURDIR)"/dist/*-any.whl "$(CURDIR)"/dist/*-cp*.whl; do \
		test -e "$$file" || continue; \
		case "$$file" in */dist/*-cp*.whl) test "$$python" = "$(PYTHON)" || continue;; esac; \
		echo "$$($$python --version): $$file"; rm -rf *; $$python -m venv env; \
		$(TRIED)/python -m pip install "$$file"; $(TRIED)/python -c "$$BUILT" "$${file##*/}"; \
		PATH="$$PWD/$(TRIED):$$PATH" sh -ec "$$TRY"; last=$$file; \
	done; done; \
	case "$$last" in *-any.whl) export POOL_PYMUNK_PURE=1;; esac; \
	$(TRIED)/python -m pip install "$$last[$(EXTRAS)]"; \
	echo "$(CURDIR)/build/source" >"$$($(TRIED)/python -c 'import sysconfig; print(sysconfig.get_path("purelib"))')/source.pth"; \
	python="$$PWD/$(TRIED)/python"; cd "$(CURDIR)/build/source"; \
	"$$(dirname "$$python")/pytest" -q -n auto tests -m "$(QUICK)"

clean:
	rm -f pool_pymunk__mypyc.* pool_pymunk/core/compiled.txt
	find pool_pymunk/core \( -name '*.so' -o -name '*.pyd' \) -delete
	rm -rf $(VENV) .venv-plain build dist .coverage .mypy_cache .pytest_cache .ruff_cache .hypothesis .benchmarks \
		docs/_build docs/examples docs/figures/made
