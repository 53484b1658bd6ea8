# Two commands for everyone: `make demo` and `make test`. Both build .venv from locked versions first.
# Another interpreter: `make demo PYTHON=python3.13`.

SHELL := /bin/sh
USABLE := import sys, venv, ensurepip; sys.exit(sys.version_info < (3, 11))
PYTHON ?= $(shell for p in python3 python3.14 python3.13 python3.12 python3.11; do \
	"$$p" -c '$(USABLE)' >/dev/null 2>&1 && { echo "$$p"; break; }; done)
BIN := .venv/bin
OUT ?= demo-out
COVERAGE_PERCENT := 97
# A lock is complete: nothing is resolved, so that what a registry publishes tomorrow does not matter.
LOCKED := --quiet --disable-pip-version-check --require-hashes --no-deps
# Bytecode is written, whatever the computer is set to: else four workers and every command that a test starts compile the same files anew.
unexport PYTHONDONTWRITEBYTECODE
quoted = '$(subst ','\'',$(1))'

.PHONY: screens vendor coverage locks package release bench bench-bridge bench-drive bench-transfer test-foreign docs soak bench-tlog bench-ladder campaign fuzz hunt demo test lint format types walls check lock clean bench-console

demo: .venv/run.stamp
	$(BIN)/pbpp demo --out $(call quoted,$(OUT))

# Four at a time, also on two cores: half of their time many tests wait for processes and links.
test: .venv/dev.stamp
	$(BIN)/pytest -n 4 --dist worksteal

.venv/pyvenv.cfg:
	@test -n "$(PYTHON)" || { echo "PBPP Rover needs Python 3.11 or newer with its venv module; set PYTHON=..." >&2; exit 1; }
	$(call quoted,$(PYTHON)) -m venv .venv

.venv/run.stamp: requirements/run.lock pyproject.toml | .venv/pyvenv.cfg
	$(BIN)/python -m pip install $(LOCKED) -r requirements/run.lock
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --no-deps --no-build-isolation -e .
	@touch $@

.venv/dev.stamp: requirements/dev.lock .venv/run.stamp
	$(BIN)/python -m pip install $(LOCKED) -r requirements/dev.lock
	@touch $@

# The parts that promises rest on: the planner, missions, and all that decides or speaks a protocol without sockets.
CONSOLE := mavlink_bridge/console
PROMISING := pbpp/*,missions/*,$(CONSOLE)/view/*,$(CONSOLE)/access.py,$(CONSOLE)/board.py,$(CONSOLE)/control.py,$(CONSOLE)/deeds.py,$(CONSOLE)/list_writer.py,$(CONSOLE)/live_desk.py,mavlink_bridge/mavlink/*,mavlink_bridge/protocol/*,mavlink_bridge/director/*,mavlink_bridge/backup/*,mavlink_bridge/tlog/*,mavlink_bridge/logbook/*,mavlink_bridge/replay/*,mavlink_bridge/fold.py
COVERING := tests/pbpp tests/missions $(filter-out %/__pycache__ %/cli %/simulator,$(wildcard tests/mavlink_bridge/*)) \
	tests/mavlink_bridge/cli/test_cli_transfers.py tests/mavlink_bridge/cli/test_ends_after_writes.py

coverage: .venv/dev.stamp
	rm -f .coverage .coverage.*
	$(BIN)/pytest -q -n 4 --dist worksteal -m "not campaign" --ignore-glob "*/test_browser*" --cov --cov-report= $(COVERING)
	$(BIN)/coverage report --include "$(PROMISING)" --precision 1 --fail-under $(COVERAGE_PERCENT)

# What the console's page is checked with: installed by its lock, once for lint and types.
PAGE := $(BIN)/python tools/page/page_tools.py
tools/page/node_modules/.installed: tools/page/package-lock.json .venv/dev.stamp
	$(PAGE) install

lint: .venv/dev.stamp tools/page/node_modules/.installed
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(PAGE) lint

format: .venv/dev.stamp
	$(BIN)/ruff check --fix .
	$(BIN)/ruff format .

types: .venv/dev.stamp tools/page/node_modules/.installed
	$(BIN)/mypy
	$(PAGE) types

# The pictures of the console in the documentation, taken in a browser.
screens: .venv/dev.stamp
	$(BIN)/python docs/screens/shoot.py

# What the page loads, copied anew from the locked packages (after a change in tools/page/package.json).
vendor: tools/page/node_modules/.installed
	$(PAGE) vendor

# The page's modules put together, for pages that are one file (after a change in the page's modules).
bundle: tools/page/node_modules/.installed
	$(PAGE) bundle

walls: .venv/dev.stamp
	$(BIN)/lint-imports

check: lint types walls test

docs: .venv/dev.stamp
	$(BIN)/python docs/generated.py
	$(BIN)/python docs/pictures/draw.py
	$(BIN)/sphinx-build -q -W --keep-going -b html docs docs/_build

locks: .venv/dev.stamp
	$(BIN)/python tools/check_locks.py $(LOCKED)

package: .venv/dev.stamp
	$(BIN)/python tools/package.py $(if $(LOWEST),--lowest)

# Version, changelog, build, commit and tag; nothing leaves this computer (docs/releasing.md).
release: .venv/dev.stamp
	$(BIN)/python tools/release.py $(VERSION)

lock: .venv/run.stamp
	$(BIN)/python -m pip install --quiet uv
	$(BIN)/uv pip compile pyproject.toml requirements/build.in --extra plot --extra web --universal --python-version 3.11 \
		--generate-hashes --no-header --quiet -o requirements/run.lock
	$(BIN)/uv pip compile pyproject.toml requirements/build.in --extra plot --extra web --extra test --extra docs --extra dev --universal \
		--python-version 3.11 --generate-hashes --no-header --quiet -c requirements/run.lock -o requirements/dev.lock
	$(BIN)/uv pip compile pyproject.toml requirements/build.in --extra plot --extra web --extra test --python-version 3.11 \
		--resolution lowest-direct --generate-hashes --no-header --quiet -o requirements/lowest.lock
	echo keyring | $(BIN)/uv pip compile requirements/release.in --universal --python-version 3.11 --excludes /dev/stdin \
		--generate-hashes --no-header --quiet -c requirements/dev.lock -o requirements/release.lock

bench: .venv/dev.stamp
	$(BIN)/python benchmarks/planner/run.py
	$(BIN)/python benchmarks/planner/growth.py
	$(BIN)/python benchmarks/table1.py --write

bench-drive: .venv/dev.stamp
	$(BIN)/python benchmarks/drive.py

bench-ladder: .venv/dev.stamp
	$(BIN)/python benchmarks/ladder.py

bench-transfer: .venv/dev.stamp
	$(BIN)/python benchmarks/transfer.py

bench-console: .venv/dev.stamp
	$(BIN)/python benchmarks/console.py

bench-bridge: .venv/dev.stamp
	$(BIN)/python benchmarks/bridge.py

test-foreign: .venv/dev.stamp
	$(BIN)/python tests/foreign/run.py

soak: .venv/dev.stamp
	$(BIN)/python tests/mavlink_bridge/director/soak.py --hours 100 --minutes $(or $(MINUTES),30) --setting $(or $(SETTING),calm)

bench-tlog: .venv/dev.stamp
	$(BIN)/python benchmarks/tlog.py

campaign: .venv/dev.stamp
	$(BIN)/python tests/mavlink_bridge/protocol/campaign.py --count $(or $(COUNT),10000) --autopilot $(or $(AUTOPILOT),ardupilot)

fuzz: .venv/dev.stamp
	$(BIN)/python tests/mavlink_bridge/tlog/fuzz_tlog.py --count 100000

hunt: .venv/dev.stamp
	$(BIN)/python tests/pbpp/hunt_edges.py --count $(or $(COUNT),20000)
	$(BIN)/python tests/pbpp/hunt_walls.py --count $(or $(COUNT),20000)

clean:
	rm -rf tools/page/node_modules .venv demo-out dist build .coverage* .hypothesis .mypy_cache .ruff_cache .pytest_cache
