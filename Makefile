# The few commands a person types. Everything is set up on the way: see scripts/setup.
.PHONY: demo studio studio-page test bench docs setup setup-web build lint test-rust test-python test-web clean
.DEFAULT_GOAL := help

PY    := .venv/bin/python
CARGO := cargo

help:           ## this list
	@grep -hE '^[a-z-]+: .*##' $(MAKEFILE_LIST) | sed 's/:[^#]*## */\t/'

setup:          ## check the tools, create .venv with the pinned Python packages
	@scripts/setup

build: setup    ## compile the core and install the Python package into .venv
	@$(PY) -m maturin develop --release --locked --quiet

demo: build     ## 100,000 even samples on the surface of a protein: report, PLY and PNG in build/demo
	@mkdir -p build/demo
	@PATH="$(CURDIR)/.venv/bin:$$PATH" $(PY) scripts/demo.py

studio: studio-page  ## the Studio, in the browser: sets it up, builds it, serves it and prints its address
	@npm --prefix web run --silent preview

studio-page: setup-web  # the built page: web/dist/studio, and for Python python/isoswarm/studio_dist
	@scripts/build-wasm
	@npm --prefix web run --silent build -- --logLevel warn
	@npm --prefix web run --silent build:widget -- --logLevel warn
	@rm -rf python/isoswarm/studio_dist
	@cp -r web/dist/studio python/isoswarm/studio_dist
	@cp web/dist/widget/widget.js python/isoswarm/studio_dist/

setup-web:      ## check the tools of the Studio, install its pinned packages
	@scripts/setup-web

# Without link-time optimisation of the WebAssembly: minutes less, the same bits.
test test-python test-web: export WASM_PROFILE ?= quick

test: lint test-rust studio-page build test-python test-web   ## everything that must pass
	@echo "make test: all passed"

lint: setup
	$(CARGO) fmt --all --check
	$(CARGO) clippy --workspace --all-targets --all-features --locked -- -D warnings
	CLIPPY_CONF_DIR=scripts/determinism $(CARGO) clippy --lib -p isoswarm-field -p isoswarm-particles --locked -- -D warnings
	$(CARGO) fmt --manifest-path web/wasm/Cargo.toml --all --check
	$(CARGO) clippy --manifest-path web/wasm/Cargo.toml --target-dir target --workspace --locked -- -D warnings
	$(PY) scripts/check_layers.py
	$(PY) -m ruff check .
	$(PY) -m ruff format --check .
	$(PY) -m mypy

test-rust: setup
	$(CARGO) test --workspace --exclude isoswarm-python --features isoswarm-field/testkit --locked --no-fail-fast

test-python: studio-page build
	$(PY) -m pytest

test-web: studio-page  ## the client in Node, native bits against those of WebAssembly, the page in Chromium
	@mkdir -p build
	$(CARGO) run --locked --quiet --package isoswarm --example parity > build/parity.json
	npm --prefix web test --silent
	npm --prefix web run --silent build:client
	npm --prefix web run --silent check
	npm --prefix web run --silent test:page

bench: build    ## the figures, side by side with peers
	@$(MAKE) --no-print-directory -C benches

docs: build     ## reference for Rust (target/doc) and Python (build/docs)
	$(CARGO) doc --workspace --exclude isoswarm-python --no-deps --locked
	$(PY) -m pdoc --math --docformat numpy --output-directory build/docs isoswarm

clean:          ## remove what was built
	rm -rf build .venv target web/dist web/node_modules web/wasm/pkg web/wasm/target python/isoswarm/studio_dist
