# Each target sets up what it needs. `make demo` and `make test` work in a fresh clone.

PYTHON ?= python3
CARGO ?= cargo
RUN = $(CARGO) run --quiet --release --bin
DEMO = runs/demo/lift/aforce/seed_1

# What needs no learning.
BASELINES = $(patsubst %,runs/%.csv,experts_paper_steps random_paper_steps random_1000 arms noise/random noise/expert)

# Where `make gallery` puts what results/gallery has.
GALLERY ?= runs/gallery

# Python's wheel, and where it is built and tried.
VENV = target/venv
# With zig's linker (`pip install ziglang` in $(VENV), or zig on the path) the wheel is one for glibc 2.17.
ZIG = $(shell { $(VENV)/bin/python -c 'import ziglang' || command -v zig; } >/dev/null 2>&1 && echo --zig --compatibility manylinux2014)

# The study, its runs and what they are reported with.
STUDY = experiments/configs/study
HYPOTHESES = $(wildcard results/study/hypotheses*.toml)
# Whose policies are disturbed: seeds 11 to 15 of a sweep, each with the folder of its runs.
STUDIED = { for sweep in table-1:table-1 prior:prior prior-parts:prior parts:table-1 hidden:hidden tuned:tuned same-steps:same-steps nudges:nudges; do \
	$(RUN) sweep -- $(STUDY)/$${sweep%:*}.toml --out runs/study/$${sweep\#*:} --list; done; } \
	| awk '$$1 ~ /^[0-9]+$$/ && $$4 <= 15 { print $$6 }'

.PHONY: own-task setup demo test test-franka wheel test-python web test-web test-bits check book release bench reproduce study pages gallery

# libtorch, pinned and verified, into third_party/libtorch (about 500 MB).
setup:
	$(PYTHON) scripts/setup-libtorch.py

# A package of one's own with a task to be changed, anywhere: `make own-task AT=../drawer`. It takes this folder's crates, versions of
# dependencies, compiled dependencies and libtorch.
own-task:
	@test -n "$(AT)" || { echo "where to? make own-task AT=FOLDER"; exit 1; }
	@test ! -e "$(AT)" || { echo "$(AT): exists; nothing was overwritten"; exit 1; }
	@mkdir -p "$(AT)/.cargo" && cp -r templates/own-task/* "$(AT)/" && cp Cargo.lock rust-toolchain.toml "$(AT)/"
	@sed -i 's#"../../#"$(CURDIR)/#' "$(AT)/Cargo.toml"
	@printf '[build]\ntarget-dir = "%s"\n[env]\nLIBTORCH = "%s"\n' "$(CURDIR)/target" "$(CURDIR)/third_party/libtorch" > "$(AT)/.cargo/config.toml"
	@echo /runs > "$(AT)/.gitignore"
	@echo "next:    cd $(AT) && cargo run --release -- replay --expert --task drawer --html drawer.html"

# SAC learns to lift a cube with the AFORCE action space; ends with a table and an animation.
demo: setup
	$(CARGO) build --release --bins
	$(RUN) train -- --config experiments/configs/demo.toml --out runs/demo --resume
	$(RUN) evaluate -- --run $(DEMO)
	$(RUN) replay -- --run $(DEMO) --episode 1 --html $(DEMO)/replay.html --gif $(DEMO)/replay.gif --every 4 --png $(DEMO)/replay.png --plot $(DEMO)/replay_traces
	@echo "the learned episode, in a browser: file://$(abspath $(DEMO))/replay.html"

# Not --workspace: it would compile the build scripts' helper crates/sac/libtorch, which has no tests, and what it needs once more.
test: setup
	$(CARGO) test --release

# The Franka host, a workspace of its own, over the real protocol against a robot in software: four minutes. The first test installs that
# robot, for which pip needs a package index. Where it cannot, the tests fail here instead of skipping.
test-franka:
	REQUIRE_SOFTWARE_ROBOT=1 $(CARGO) test --release --manifest-path hosts/franka/Cargo.toml

$(VENV)/installed: python/requirements.txt
	$(PYTHON) -m venv $(VENV)
	$(VENV)/bin/pip install --quiet --requirement python/requirements.txt
	touch $@

# The package `aforce`, in target/wheels.
wheel: $(VENV)/installed
	cp LICENSE-MIT LICENSE-APACHE python
	$(PYTHON) python/third_party.py python/THIRD-PARTY.txt
	rm -f target/wheels/aforce-*.whl
	PATH="$(CURDIR)/$(VENV)/bin:$$PATH" maturin build --release --quiet $(ZIG) --manifest-path python/Cargo.toml --target-dir target/python --out target/wheels

# Tests of the wheel, in an environment of their own. Those of other packages run where these are there: `pip install` them in $(VENV).
test-python: wheel
	$(VENV)/bin/pip install --quiet --force-reinstall --no-deps target/wheels/aforce-*.whl
	$(VENV)/bin/python -m pytest -q -rs python/tests

# The live page in target/live: environment, law and kept policies in WebAssembly. Needs no libtorch.
MODULE = target/web/wasm32-unknown-unknown/release/live.wasm
web:
	@rustc --print target-libdir --target wasm32-unknown-unknown | xargs test -d || { echo "Rust's library for browsers is missing: rustup target add wasm32-unknown-unknown"; exit 1; }
	cd web && $(CARGO) build --release --lib --target wasm32-unknown-unknown --target-dir ../target/web
	$(PYTHON) web/assemble.py $(MODULE) target/live

# Its program, then the page in a headless Chromium (pip install playwright pillow).
test-web: web
	cd web && $(CARGO) test --release --target-dir ../target/web
	$(PYTHON) scripts/check_live.py target/live

# The same bits on this machine, under node and under qemu: of what is installed.
test-bits:
	$(PYTHON) web/test_bits.py

check: setup
	$(CARGO) fmt --all --check
	$(CARGO) fmt --manifest-path python/Cargo.toml --check
	$(CARGO) fmt --manifest-path hosts/franka/Cargo.toml --check
	$(CARGO) fmt --manifest-path web/Cargo.toml --check
	$(CARGO) clippy --release --workspace --all-targets -- -D warnings
	$(CARGO) clippy --release --manifest-path python/Cargo.toml --target-dir target/python -- -D warnings
	$(CARGO) clippy --release --manifest-path hosts/franka/Cargo.toml --all-targets -- -D warnings
	$(CARGO) clippy --release --manifest-path web/Cargo.toml --target-dir target/web -- -D warnings
	RUSTDOCFLAGS="-D warnings" $(CARGO) doc --release --workspace --no-deps
	@if command -v cargo-deny > /dev/null; then for workspace in . python; do \
		$(CARGO) deny --manifest-path $$workspace/Cargo.toml --offline check licenses bans sources || exit 1; done; \
		else echo "skipped: licences of dependencies (cargo install cargo-deny)"; fi

# The pages of docs/SUMMARY.md as a book in book/, with search and without a network. mdbook is installed once.
book:
	@command -v mdbook > /dev/null || { echo "mdbook is missing: cargo install mdbook --version 0.5.4 --no-default-features --features search --locked"; exit 1; }
	$(PYTHON) scripts/book.py stage
	mdbook build
	$(PYTHON) scripts/book.py check

# What a tag carries, of the commit that is checked out: wheel, source archive, the crate `aforce`, checksums. Nothing is uploaded.
VERSION = $(shell sed -n 's/^version = "\(.*\)"/\1/p' Cargo.toml | head -1)
DIST = target/dist
release: $(VENV)/installed
	@git diff --quiet HEAD || { echo "there are changes that are not committed: a release is of a commit"; exit 1; }
	$(VENV)/bin/pip install --quiet ziglang
	$(MAKE) wheel
	rm -rf $(DIST)
	mkdir -p $(DIST)
	git archive --prefix=aforce-workbench-$(VERSION)/ --output $(DIST)/aforce-workbench-$(VERSION).tar.gz HEAD
	$(CARGO) package --package aforce
	cp target/package/aforce-$(VERSION).crate target/wheels/aforce-*.whl $(DIST)
	cd $(DIST) && sha256sum * > SHA256SUMS && cat SHA256SUMS

bench: setup
	$(CARGO) bench --workspace

# What is in results/, once more below runs/: experts and random actions (half a second of one core per episode, and random_1000 has
# 18 000 of them), the wiping experiment (seven minutes), then the study.
reproduce: setup $(BASELINES)
	$(RUN) wiping -- --out runs/wiping
	$(MAKE) study

# The study of results/study, once more below runs/study: its learner's tournament (113 runs), its stages in the order of what they decide
# (422 runs, of which a search stops half early), the policies of all but the search under every
# disturbance. About 60 core-hours on an AMD EPYC, a fourth of it the tournament; what is done is not done again.
study: setup
	$(RUN) sweep -- experiments/configs/tournament.toml
	$(RUN) sweep -- experiments/configs/tournament-confirm.toml
	$(RUN) report -- runs/tournament
	$(RUN) sweep -- experiments/configs/tournament-five.toml
	$(RUN) report -- runs/tournament-five
	$(RUN) sweep -- $(STUDY)/table-1.toml --out runs/study/table-1
	$(RUN) sweep -- $(STUDY)/prior.toml --out runs/study/prior
	$(RUN) sweep -- $(STUDY)/prior-parts.toml --out runs/study/prior
	$(RUN) sweep -- $(STUDY)/parts.toml --out runs/study/table-1
	$(RUN) sweep -- $(STUDY)/search.toml --out runs/study/search
	$(RUN) sweep -- $(STUDY)/tuned.toml --out runs/study/tuned
	$(RUN) sweep -- $(STUDY)/same-steps.toml --out runs/study/same-steps
	$(RUN) sweep -- $(STUDY)/hidden.toml --out runs/study/hidden
	$(RUN) sweep -- $(STUDY)/nudges.toml --out runs/study/nudges
	for run in $$($(STUDIED)); do test -e $$run/disturbed.csv || $(RUN) evaluate -- --run $$run --episodes 5 \
		--disturb experiments/configs/disturbances.toml --csv $$run/disturbed.csv || exit 1; done
	cp results/study/energy_ratio.toml runs/study/
	$(RUN) report -- runs/study $(HYPOTHESES:%=--hypotheses %)

# Tables, figures and pages of results, made of the runs that are kept there.
pages: setup
	for study in results/study results/second-study results/insert; do \
		$(RUN) report -- $$study $$(for file in $$study/hypotheses*.toml; do echo --hypotheses $$file; done) || exit 1; done
	$(RUN) report -- results --pages

runs/random_paper_steps.csv: | setup
	$(RUN) baselines -- random --tasks lift,door,wipe --spaces aforce,low,variable,osc,robosuite-variable,robosuite-osc --episodes 30 --out $@

runs/experts_paper_steps.csv: | setup
	$(RUN) baselines -- expert --tasks lift,door,wipe --spaces aforce,low,variable,osc,robosuite-variable,robosuite-osc --episodes 30 --out $@

runs/arms.csv: | setup
	$(RUN) baselines -- expert --sweep experiments/configs/arms.toml --episodes 40 --out $@

# What noise costs, factor by factor; with the script beside random actions.
runs/noise/%.csv: | setup
	$(RUN) baselines -- $* --sweep experiments/configs/noise.toml --episodes 30 --out $@ --plot runs/noise/$*

runs/random_1000.csv: | setup
	$(RUN) baselines -- random --tasks lift,door,wipe --spaces aforce,low,variable,osc,robosuite-variable,robosuite-osc --episodes 1000 --out $@

# Pages, animations and README of results/gallery: typical runs, chosen by the script.
gallery: setup
	$(CARGO) build --release --bin replay --bin evaluate
	$(PYTHON) scripts/gallery.py target/release results $(GALLERY)
