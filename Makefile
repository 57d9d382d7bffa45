# A new user needs two commands: `make demo` and `make test`. Each installs the system packages that are missing.
CARGO ?= cargo
TARGET := $(or $(CARGO_TARGET_DIR),target)
PACKAGES := build-essential pkg-config libhdf5-dev
# The additional packages that the feature `ms` (Measurement Sets) needs.
MS_PACKAGES := casacore-dev
# The additional packages that the feature `mpi` needs: bindgen reads the headers of MPI with libclang.
MPI_PACKAGES := libopenmpi-dev openmpi-bin libclang-dev
# The browser that looks at the report of a run in `make interop`.
BROWSER_PACKAGES := chromium
# The encoder of films, which `make interop` uses.
FILM_PACKAGES := ffmpeg
DEMO := demo
# N is the number of executions of each target of `make fuzz`. PART of them run in one process, because the HDF5 library does not
# survive an unlimited number of damaged files in one process.
N ?= 1000000
PART ?= 50000

.PHONY: demo test test-ms lint interop visibilities fuzz bench bench-peers bench-book bench-cost pictures page deps deps-ms deps-mpi deps-interop

demo: deps
	$(CARGO) build --release --locked
	rm -rf $(DEMO)
	$(TARGET)/release/cittert run docs/examples/airport.toml -o $(DEMO)
	@echo
	@echo "Open $(DEMO)/report.html; the pictures are $(DEMO)/scene.png, $(DEMO)/dirty.png, $(DEMO)/clean-image.png and $(DEMO)/selfcal-image.png."

# Without `--tests`, cargo would build the examples too, which `make lint` checks.
test: deps
	$(CARGO) test --workspace --locked --tests
	$(CARGO) test --workspace --locked --doc

# The tests of the formats again, now with Measurement Sets.
test-ms: deps-ms
	$(CARGO) test -p cittert-formats --features ms --locked

lint: deps deps-ms deps-mpi
	$(CARGO) fmt --all --check
	$(CARGO) clippy --workspace --all-targets --locked -- -D warnings
	$(CARGO) clippy -p cittert-formats --features ms --all-targets --locked -- -D warnings
	$(CARGO) clippy -p cittert --features mpi --all-targets --locked -- -D warnings
	RUSTDOCFLAGS="-D warnings" $(CARGO) doc --workspace --no-deps --locked

# Other programs (WSClean, CASA, pyuvdata, ehtim) judge the files that cittert writes. The first run installs them below ~/.cache.
# Some of these tests read real public visibilities, which this project does not contain, from the folder CITTERT_DATA.
interop: visibilities deps-interop
	$(CARGO) build --release --locked --features ms,mpi
	$(CARGO) build --release --locked -p cittert-formats --features ms --example samples
	bash tests/interop/run.sh

# Fail before anything is built where the real visibilities are missing.
visibilities:
	@bash tests/interop/run.sh --check

# Reads damaged files, N of each kind: `make fuzz N=1000000`. `make test` runs a few thousand of each.
fuzz: deps
	for seed in $$(seq 1 $$((($(N) + $(PART) - 1) / $(PART)))); do \
	  CITTERT_FUZZ=$(PART) CITTERT_FUZZ_SEED=$$seed $(CARGO) test --release --locked -p cittert-formats --test fuzz -- --nocapture \
	  && CITTERT_FUZZ=$(PART) CITTERT_FUZZ_SEED=$$seed $(CARGO) test --release --locked -p cittert --test fuzz -- --nocapture || exit 1; \
	done

bench: deps
	$(CARGO) bench --locked

# Times cittert and its peers in turn on the common workloads, and prints a table of ratios.
bench-peers: deps
	$(CARGO) build --release --locked --bin cittert --example core
	bash tests/bench/peers.sh

# Measures the processor time of imaging and writes it into the book, fits the cost model of `--dry-run` to this machine, and checks it.
bench-book: deps bench-cost
	$(CARGO) build --release --locked --example core
	$(TARGET)/release/examples/core book

# The cost model alone. The machine must be quiet.
bench-cost: deps
	$(CARGO) build --release --locked
	python3 tests/bench/cost.py fit $(TARGET)/release/cittert
	$(CARGO) build --release --locked
	python3 tests/bench/cost.py check $(TARGET)/release/cittert --page

# Makes the pictures of the README anew.
pictures: deps
	$(CARGO) build --release --locked
	CITTERT=$(TARGET)/release/cittert bash docs/images/make.sh

# Builds the page of `cittert design` anew from its sources. Only this needs Node; the program embeds what is built here.
page:
	@command -v npm >/dev/null 2>&1 || { echo "make page needs Node 20 or newer with npm"; exit 1; }
	cd src/cli/design/page && npm ci --no-audit --no-fund && npm run build

deps: WANTED = $(PACKAGES)
deps-ms: WANTED = $(PACKAGES) $(MS_PACKAGES)
deps-mpi: WANTED = $(PACKAGES) $(MPI_PACKAGES)
deps-interop: WANTED = $(PACKAGES) $(MS_PACKAGES) $(MPI_PACKAGES) $(BROWSER_PACKAGES) $(FILM_PACKAGES)

# apt installs only the packages that dpkg does not list as installed.
deps deps-ms deps-mpi deps-interop:
	@missing=; for p in $(WANTED); do \
	  dpkg-query -W -f='$${Status}' $$p 2>/dev/null | grep -q 'ok installed' || missing="$$missing $$p"; done; \
	[ -z "$$missing" ] && exit 0; \
	if [ "$$(id -u)" = 0 ]; then sudo=; elif command -v sudo >/dev/null 2>&1; then sudo=sudo; else \
	  echo "Missing system packages. Ask an administrator to run:"; \
	  echo "  apt-get update && apt-get install -y$$missing"; exit 1; fi; \
	echo "Installing:$$missing"; \
	$$sudo apt-get update -qq && DEBIAN_FRONTEND=noninteractive $$sudo apt-get install -y --no-install-recommends $$missing
