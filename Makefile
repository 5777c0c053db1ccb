# Each target sets up what it needs. `make demo` and `make test` work in a fresh clone.

PYTHON ?= python3
CARGO ?= cargo
RUN = $(CARGO) run --quiet --release --bin
DEMO = runs/demo/lift/aforce/seed_1

# Tables of scripted and random episodes, which need no training.
BASELINES = $(patsubst %,runs/%.csv,experts_paper_steps random_paper_steps random_1000 arms noise/random noise/expert)

# Output folder of `make gallery`.
GALLERY ?= runs/gallery

# Virtual environment in which the Python wheel is built and tested.
VENV = target/venv
# If zig is installed (`pip install ziglang` in $(VENV), or zig on the path), its linker makes a wheel for glibc 2.17.
ZIG = $(shell { $(VENV)/bin/python -c 'import ziglang' || command -v zig; } >/dev/null 2>&1 && echo --zig --compatibility manylinux2014)

# Sweeps of the study, and the hypotheses that its report tests.
STUDY = experiments/configs/study
HYPOTHESES = $(wildcard results/study/hypotheses*.toml)
# Shell command that prints the run folders whose policies are played under disturbances: seeds 11 to 15 of each SWEEP:FOLDER.
STUDIED = { for sweep in table-1:table-1 prior:prior prior-parts:prior parts:table-1 hidden:hidden tuned:tuned same-steps:same-steps nudges:nudges; do \
	$(RUN) sweep -- $(STUDY)/$${sweep%:*}.toml --out runs/study/$${sweep\#*:} --list; done; } \
	| awk '$$1 ~ /^[0-9]+$$/ && $$4 <= 15 { print $$6 }'

.PHONY: own-task setup demo test test-franka wheel test-python web test-web test-bits check book release bench reproduce study pages gallery

# libtorch, pinned and verified, into third_party/libtorch (about 500 MB).
setup:
	$(PYTHON) scripts/setup-libtorch.py

# Copies templates/own-task, a package with an example task to edit, to the folder AT: `make own-task AT=../drawer`. The package uses this
# repository's crates, Cargo.lock, build folder and libtorch.
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

# Without --workspace, which would also compile crates/sac/libtorch, a helper of the build scripts without tests, and its dependencies again.
test: setup
	$(CARGO) test --release

# Tests of the Franka host, a separate workspace, against a robot in software that speaks Franka's protocol: four minutes. The first test
# installs that robot with pip, which needs a package index. If it cannot be installed, the tests fail here instead of being skipped.
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

# Tests of the wheel in $(VENV). Tests that need other packages (Stable-Baselines3, robosuite) are skipped unless $(VENV) has these.
test-python: wheel
	$(VENV)/bin/pip install --quiet --force-reinstall --no-deps target/wheels/aforce-*.whl
	$(VENV)/bin/python -m pytest -q -rs python/tests

# The live page in target/live: environment, law and kept policies in WebAssembly. Needs no libtorch.
MODULE = target/web/wasm32-unknown-unknown/release/live.wasm
web:
	@rustc --print target-libdir --target wasm32-unknown-unknown | xargs test -d || { echo "Rust's library for browsers is missing: rustup target add wasm32-unknown-unknown"; exit 1; }
	cd web && $(CARGO) build --release --lib --target wasm32-unknown-unknown --target-dir ../target/web
	$(PYTHON) web/assemble.py $(MODULE) target/live

# Tests the live page's Rust code, then the page itself in a headless Chromium (pip install playwright pillow).
test-web: web
	cd web && $(CARGO) test --release --target-dir ../target/web
	$(PYTHON) scripts/check_live.py target/live

# Tests that episodes have the same bits on this machine, under node and for aarch64 under qemu. What is not installed is skipped.
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

# Builds the pages of docs/SUMMARY.md as a book in book/. It has search and needs no network.
book:
	@command -v mdbook > /dev/null || { echo "mdbook is missing: cargo install mdbook --version 0.5.4 --no-default-features --features search --locked"; exit 1; }
	$(PYTHON) scripts/book.py stage
	mdbook build
	$(PYTHON) scripts/book.py check

# Files of a release, made from the commit that is checked out: wheel, source archive, the crate `aforce`, checksums. Nothing is uploaded.
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

# Makes part of results/ again below runs/: the tables of scripts and random actions (half a second of one core per episode; random_1000
# has 18 000 episodes), the wiping experiment (seven minutes), then the study.
reproduce: setup $(BASELINES)
	$(RUN) wiping -- --out runs/wiping
	$(MAKE) study

# Makes the study of results/study again below runs/: the tournament that chose the learner (113 runs), the stages of the study (422 runs, of
# which the search stops its weaker candidates early), and the policies of all stages but the search under every disturbance. It takes about
# 60 core-hours on an AMD EPYC, a quarter of them for the tournament. Finished runs are not repeated.
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

# Makes the tables, figures and pages of results/ from the runs that are stored there.
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

# Energy that a space spends under random actions or the script, with one factor of the space changed at a time.
runs/noise/%.csv: | setup
	$(RUN) baselines -- $* --sweep experiments/configs/noise.toml --episodes 30 --out $@ --plot runs/noise/$*

runs/random_1000.csv: | setup
	$(RUN) baselines -- random --tasks lift,door,wipe --spaces aforce,low,variable,osc,robosuite-variable,robosuite-osc --episodes 1000 --out $@

# Pages, animations and README of results/gallery. scripts/gallery.py chooses typical runs.
gallery: setup
	$(CARGO) build --release --bin replay --bin evaluate
	$(PYTHON) scripts/gallery.py target/release results $(GALLERY)
