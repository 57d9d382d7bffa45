# The two commands of a newcomer are `make demo` and `make test`. Each installs the system packages that are missing.
CARGO ?= cargo
PACKAGES := build-essential pkg-config libhdf5-dev
DEMO := demo

.PHONY: demo test lint interop bench deps book

demo: deps
	$(CARGO) build --release --locked
	rm -rf $(DEMO)
	target/release/cittert run docs/examples/millimetre-imager.toml -o $(DEMO)
	@echo
	@echo "Open $(DEMO)/report.html; the pictures are $(DEMO)/dirty.png and $(DEMO)/clean-image.png."

test: deps
	$(CARGO) test --workspace --locked

lint: deps
	$(CARGO) fmt --all --check
	$(CARGO) clippy --workspace --all-targets --locked -- -D warnings
	RUSTDOCFLAGS="-D warnings" $(CARGO) doc --workspace --no-deps --locked

# Other programs (WSClean, CASA, pyuvdata, ehtim) judge what we write. Installs them below ~/.cache on the first run.
interop: deps
	$(CARGO) build --release --locked
	bash tests/interop/run.sh

bench: deps
	$(CARGO) bench --locked

# dpkg knows what is there; apt is asked only for what is not.
deps:
	@missing=; for p in $(PACKAGES); do \
	  dpkg-query -W -f='$${Status}' $$p 2>/dev/null | grep -q 'ok installed' || missing="$$missing $$p"; done; \
	[ -z "$$missing" ] && exit 0; \
	if [ "$$(id -u)" = 0 ]; then sudo=; elif command -v sudo >/dev/null 2>&1; then sudo=sudo; else \
	  echo "Missing system packages. Ask an administrator to run:"; \
	  echo "  apt-get update && apt-get install -y$$missing"; exit 1; fi; \
	echo "Installing:$$missing"; \
	$$sudo apt-get update -qq && DEBIAN_FRONTEND=noninteractive $$sudo apt-get install -y --no-install-recommends $$missing
