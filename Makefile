# What can be done here. `make help` lists it.

.DEFAULT_GOAL := help
SHELL := /bin/sh
.SUFFIXES:
.DELETE_ON_ERROR:

# A sourced ROS 2 environment puts its own packages before ours.
unexport PYTHONPATH PYTHONHOME
export PYTHONNOUSERSITE := 1
export PIP_DISABLE_PIP_VERSION_CHECK := 1

# Tests never speak to other machines.
unit e2e ros-test soak soak-ros pictures screens browsers bench: export ROS_AUTOMATIC_DISCOVERY_RANGE := LOCALHOST

# Whose packages a sourced ROS 2 can lend: the Python that it was built for, on Ubuntu the system's.
PYTHON ?= python3
BIN := .venv/bin
# How many processes share the Python tests, of which many wait; each test file stays with one.
PROCESSES ?= 4
ROS := .venv-ros/bin
# Tests see nothing of a sourced ROS 2 either; `make run` does.
BARE := env -u AMENT_PREFIX_PATH -u COLCON_PREFIX_PATH -u LD_LIBRARY_PATH
KEEPING := $(BARE) -u PYTHONDONTWRITEBYTECODE
NODE := scripts/with-node
STEP := scripts/step
# Tests take the one without windows where it is there: it is quicker, and not in every distribution.
BROWSER = command -v chromium-headless-shell >/dev/null || scripts/need chromium=chromium
NPM := $(NODE) npm --prefix frontend
LOCK = $(BIN)/uv pip compile --quiet --generate-hashes --universal --python-version 3.11 --no-header \
	--no-annotate --upgrade
HELP_SOURCES := README.md CONTRIBUTING.md CHANGELOG.md frontend/public/mark.svg server/action_assistant/umrf/codes.py \
	server/action_assistant/system/diagnostics.py \
	$(shell find docs frontend/src/api/schema -type f -not -name '*.pyc' 2>/dev/null)
PAGE_SOURCES := $(shell find frontend/src frontend/public frontend/index.html frontend/vite.config.ts frontend/tsconfig.json -type f 2>/dev/null)

.PHONY: help
help: ## this list
	@awk -F ':.*## ' '/^[a-z0-9-]+:.*## / { printf "  make %-12s %s\n", $$1, $$2 }' $(MAKEFILE_LIST)

.PHONY: setup
setup: .venv/.done frontend/dist/index.html build/help/index.html ## everything that running and testing needs

.PHONY: site
site: build/help/index.html ## the documentation that is under Help in the page: build/help

.PHONY: ros
ros: .venv-ros/.done ## what reaching robots over ROS 2 needs, on a machine without ROS: .venv-ros

.PHONY: run
run: .venv/.done frontend/dist/index.html ## start the editor and the runner, and open the page (ARGS="--port 9000 --no-open")
	@# Where the documentation cannot be built, the product runs without Help.
	@$(MAKE) --no-print-directory build/help/index.html || echo "» no Help in the page: it is built with the next make run"
	@$(BIN)/action-assistant serve $(ARGS)

.PHONY: dev
dev: setup ## like run, and rebuild the page on every change
	@(cd frontend && exec ../$(NODE) node_modules/.bin/vite build --watch --logLevel warn) & page=$$!; \
		trap "kill $$page" EXIT; $(BIN)/action-assistant serve $(ARGS)

.PHONY: check
check: check-server check-page ## formatting, lint, types, layers and what is unused, both languages

# Alarms of size, circles, what documents refer to, and language: seconds, so before each commit.
STRUCTURE := tests/test_tree.py tests/test_references.py tests/test_glossary.py tests/test_language.py

PAGE_STRUCTURE := src/tree.test.ts

.PHONY: check-server
check-server: .venv/.done ## the server's half of check
	@echo "» ruff, mypy, layers, dependencies"
	@$(BIN)/ruff format --check --quiet . && $(BIN)/ruff check --quiet .
	@$(BIN)/mypy
	@$(BIN)/lint-imports
	@$(BIN)/deptry .
	@$(BARE) $(BIN)/python -m pytest -q $(STRUCTURE)

.PHONY: check-page
check-page: frontend/node_modules/.done ## the page's half of check
	@echo "» Biome, tsc, knip"
	@$(NPM) run --silent check
	@cd frontend && ../$(NODE) node_modules/.bin/vitest run --reporter=dot $(PAGE_STRUCTURE)

.PHONY: fix
fix: .venv/.done frontend/node_modules/.done ## mend what the formatters and linters can
	@$(BIN)/ruff check --fix --quiet . ; $(BIN)/ruff format --quiet .
	@$(NPM) run --silent fix

.PHONY: types
types: .venv/.done frontend/node_modules/.done ## the page's API types, from the OpenAPI of both processes
	@PYTHONPATH=tests PYTHONWARNINGS=ignore $(BIN)/python -m support.openapi frontend/src/api/schema
	@cd frontend && ../$(NODE) node api-types.mjs

.PHONY: quick
quick: setup ## lint, types and the tests of what changed since main, in minutes (AREA=runner/stop for a folder)
	@PYTHONPATH=tests $(BARE) $(BIN)/python -m support.quick $(AREA)

.PHONY: figures
figures: .venv/.done ## sizes and language of the code, today and at an earlier commit (AT=COMMIT)
	@PYTHONPATH=tests $(BIN)/python -m support.figures $(AT)

.PHONY: test
test: setup ros ## every check and every test, also in a real browser
	@# Most of these wait for processes and robots: together they take little longer than the longest.
	@$(MAKE) --no-print-directory --jobs=4 --output-sync=target check unit ros-test
	@$(MAKE) --no-print-directory e2e

.PHONY: unit
unit: unit-server unit-page ## the tests of the server and of the page's pure parts

.PHONY: unit-server
unit-server: setup ## the tests of the server
	@echo "» pytest"
	@# One reads all tests and keeps what pytest makes of them, or each process would make it for itself.
	@$(KEEPING) $(BIN)/pytest -q --collect-only $(STRUCTURE:%=--ignore=%) $(PYTEST) > /dev/null 2>&1 || true
	@$(KEEPING) scripts/retry-alone .pytest_cache $(BIN)/pytest -q --numprocesses $(PROCESSES) --dist loadfile --no-loadscope-reorder $(STRUCTURE:%=--ignore=%) $(PYTEST)

.PHONY: unit-page
unit-page: setup ## the tests of the pure parts of the page
	@echo "» vitest"
	@$(NPM) run --silent test -- --exclude $(PAGE_STRUCTURE)

# They mostly wait for robots, so two processes share the files, by their first letters.
ROS_HALVES := ros-test-a-l ros-test-m-z

.PHONY: ros-test
ros-test: $(ROS_HALVES) ## tests over real rclpy, on loopback

$(ROS_HALVES): ros-test-%: ros
	@echo "» pytest over rclpy, $*"
	@# 5: with PYTEST="-k …" this half may have no test.
	@$(BARE) scripts/retry-alone .pytest_cache/$@ $(ROS)/python -m pytest -q tests/ros/test_[$*]*.py $(PYTEST) || test "$$?$(if $(PYTEST),,!)" = 5

.PHONY: contract
contract: ros ## what a link promises, with a real engine: NAME=David [DOMAIN=0] [RMW=…] [ACTION=…]; it moves
	@TEST_ENGINE_NAME="$(NAME)" TEST_ENGINE_DOMAIN="$(or $(DOMAIN),0)" TEST_ENGINE_ACTION="$(ACTION)" \
		$(if $(RMW),RMW_IMPLEMENTATION="$(RMW)") \
		$(BARE) $(ROS)/python -m pytest -q tests/ros/test_contract.py -k real_engine

.PHONY: e2e
e2e: setup ros ## tests in Chromium against the real processes
	@$(BROWSER)
	@echo "» Playwright"
	@$(BARE) $(NPM) run --silent e2e

.PHONY: coverage
coverage: .venv/.done ## which lines of UMRF, start, Stop and runs the tests of umrf and runner never reach
	@mkdir -p build && $(BIN)/coverage erase
	@# What is measured runs slower, so tests that bound its time may fail here; the report comes anyway.
	-@$(BARE) $(BIN)/coverage run -m pytest -q --numprocesses $(PROCESSES) --dist loadfile --timeout=900 \
		tests/umrf tests/runner $(PYTEST)
	@$(BIN)/coverage combine --quiet && $(BIN)/coverage report

.PHONY: soak
soak: setup ## tests that take longer than CI may, by the thousand (ARGS="kills images" for some of them)
	@$(BIN)/pip install --quiet 'pyarrow>=20' # of the extra `parquet`
	@$(BIN)/python bench/soak.py $(ARGS)
	@test -n "$(ARGS)" || { $(BIN)/pip install --quiet atheris && $(BIN)/python tests/fuzz/soak_umrf.py 300; }

.PHONY: soak-ros
soak-ros: ros ## the same over real rclpy: 200 histories, hundreds of stops, led runs
	TEST_ROS_HISTORIES=200 TEST_ROS_AT_ONCE=4 TEST_STOP_CLICKS=50 $(BARE) $(ROS)/python -m pytest -q -s \
		--timeout=0 tests/ros/test_false_confirmations.py tests/ros/test_stop_latency.py
	TEST_LED_GRAPHS=235 TEST_LED_FAULTS=5 TEST_STOP_CLICKS=100 $(BARE) $(ROS)/python -m pytest -q -s \
		--timeout=0 tests/ros/test_conducted.py tests/ros/test_led_runner_faults.py \
		tests/ros/test_led_stop_latency.py
	TEST_LONG=1 $(BARE) $(ROS)/python -m pytest -q -s -m long tests/ros

.PHONY: containers
containers: setup ## build the images and drive docker-compose.yml with podman, as root on Debian (ARGS="-k proxy")
	@$(BROWSER)
	@scripts/containers $(ARGS)

.PHONY: workspace
workspace: setup ## a sourced ROS 2 as Ubuntu 24.04 lays it out, in a root of its own (PYTHON312=…, FOLDER=…)
	@scripts/try-workspace "$(or $(PYTHON312),python3.12)" "$(or $(FOLDER),/var/tmp/action-assistant-workspace)"

.PHONY: pictures
pictures: setup ## take the pictures of the documentation from the running product
	@$(BROWSER)
	@PICTURES=1 $(NPM) run --silent e2e -- e2e/pictures.spec.ts e2e/tutorial-pictures.spec.ts
	@$(BIN)/python bench/picture_age.py --taken

.PHONY: screens
screens: setup ## take every page on every screen, to be looked at: frontend/screens, or TO=DIR
	@$(BROWSER)
	@SCREENS=1 $(if $(TO),SCREENS_TO="$(abspath $(TO))") $(NPM) run --silent e2e -- e2e/screens.spec.ts

.PHONY: browsers
browsers: setup ## the main job in Firefox and WebKit, by keys and by touch
	@scripts/need firefox-esr=firefox-esr WebKitWebDriver=webkit2gtk-driver Xvfb=xvfb
	@BROWSERS=1 $(NPM) run --silent e2e -- e2e/other-browsers.spec.ts --workers=1

.PHONY: newcomer
newcomer: frontend/node_modules/.done ## count what eight actions cost by mouse: URL=http://127.0.0.1:8000 TOKEN=…
	@ACTION_ASSISTANT_TOKEN="$(TOKEN)" $(NODE) node bench/newcomer.mjs "$(or $(URL),http://127.0.0.1:8000)"

.PHONY: monitoring
monitoring: setup ## check alerts, their tests and the metrics of a running product with promtool
	@scripts/need promtool=prometheus
	@promtool check rules docs/monitoring/alerts.yml && promtool test rules docs/monitoring/alerts_test.yml
	@PYTHONPATH=tests $(BIN)/python bench/monitoring.py

.PHONY: bench
bench: setup ## measure speed; prints tables (ARGS="rooms" for one benchmark)
	@$(BIN)/python bench/run.py $(ARGS)

.PHONY: performance
performance: setup ## measure, and write the tables into docs/performance.md (ARGS="rooms browser")
	@$(BIN)/python bench/performance.py $(ARGS)

.PHONY: migrate
migrate: .venv/.done ## bring the databases to this version (ARGS="--data DIR")
	@$(BIN)/action-assistant migrate $(ARGS)

.PHONY: build
build: setup ## the wheel, with migrations, the built page and its help, in dist/
	@$(STEP) wheel $(BIN)/pip wheel --quiet --no-deps --no-build-isolation --wheel-dir dist .
	@ls dist/*.whl

.PHONY: bundle
bundle: build ## everything for a machine of this kind without a network: a tar file in dist/
	@scripts/bundle $(BIN)/python "$$(ls -t dist/*.whl | head -1)"

.PHONY: images
images: ## build the container images of this commit with Docker, and write their tag into .env
	@touch .env && sed -i -E '/^(IMAGE_VERSION|SOURCE_COMMIT)=/d' .env && scripts/build_version.py env >>.env
	@docker compose build

.PHONY: release
release: ## changelog, version, commit and tag in one go: VERSION=1.2.3
	@scripts/release "$(VERSION)"

.PHONY: lock
lock: .venv/.done ## renew requirements/*.txt from what pyproject.toml asks for
	@$(BIN)/pip install --quiet uv
	@$(LOCK) pyproject.toml --group dev --output-file requirements/dev.txt
	@$(LOCK) --extra ros pyproject.toml requirements/ros.in --output-file requirements/ros.txt
	@$(LOCK) pyproject.toml requirements/run.in --output-file requirements/run.txt
	@$(LOCK) requirements/build.in --output-file requirements/build.txt
	@$(LOCK) requirements/site.in --output-file requirements/site.txt

.venv/.done: requirements/dev.txt pyproject.toml scripts/need scripts/packages
	@scripts/need "$(PYTHON)=python3 python3-venv" || exit 1
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11))' || \
		{ echo "Python 3.11 or newer is needed; this is $$($(PYTHON) --version)." >&2; exit 1; }
	@$(PYTHON) -c 'import ensurepip, venv' 2>/dev/null || scripts/need no-such-command=python3-venv
	@test -x $(BIN)/python || $(PYTHON) -m venv .venv
	@$(STEP) "Python packages into .venv" scripts/packages $(BIN)/python --require-hashes --requirement requirements/dev.txt
	@$(BIN)/pip install --quiet --no-deps --no-build-isolation --editable .
	@# Where interpreters may write no bytecode, every process of ours would compile all of it anew.
	@$(BIN)/python -m compileall -q server tests
	@touch $@

# The wheels of rclpy start every interpreter of their environment anew, so they have one of their own.
.venv-ros/.done: requirements/ros.txt pyproject.toml scripts/build-messages $(wildcard ros/temoto_msgs/* ros/temoto_msgs/*/*)
	@scripts/need cmake=cmake ninja=ninja-build g++=g++ || exit 1
	@test -x $(ROS)/python || $(PYTHON) -m venv .venv-ros
	@$(STEP) "rclpy and Python packages into .venv-ros" \
		scripts/packages $(ROS)/python --require-hashes --requirement requirements/ros.txt
	@$(ROS)/python -m pip install --quiet --no-deps --no-build-isolation --editable .
	@$(STEP) "messages of TeMoto into .venv-ros" scripts/build-messages .venv-ros ros/temoto_msgs
	@sha256sum requirements/ros.txt | cut -d " " -f 1 >$@

frontend/node_modules/.done: frontend/package-lock.json scripts/with-node
	@$(STEP) "Node packages into frontend/node_modules" $(NPM) ci --no-audit --no-fund --loglevel=error
	@touch $@

frontend/dist/index.html: frontend/node_modules/.done $(PAGE_SOURCES)
	@$(STEP) "the page into frontend/dist" $(NPM) run --silent build
	@touch $@

# Nothing but Help needs what builds the documentation.
.venv/.site: .venv/.done requirements/site.txt
	@$(STEP) "what builds the help into .venv" scripts/packages $(BIN)/python --require-hashes --requirement requirements/site.txt
	@touch $@

build/help/index.html: .venv/.site $(HELP_SOURCES)
	@$(STEP) "the help into build/help" $(BIN)/python -B docs/site/build.py build/help
	@touch $@
