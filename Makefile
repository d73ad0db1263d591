# `make demo` and `make test` set up everything themselves from a bare Python 3.11+.
PYTHON ?= python3
BIN := .venv/bin
OUT := demo-out
export PATH := $(CURDIR)/$(BIN):$(PATH)

.PHONY: demo test slow format clean

demo: $(BIN)/.installed
	@$(BIN)/python -m fixtures $(OUT)/fixtures 2>/dev/null
	@sh fixtures/demo.sh $(OUT)/fixtures/biped.glb $(OUT)

test: $(BIN)/.installed
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy
	$(BIN)/python -m pytest -n auto --dist loadfile -m "not slow"

# What takes minutes: real files under three bounds, judged by three.js. CI runs it too.
slow: $(BIN)/.installed
	$(BIN)/python -m pytest -n auto -m slow

format: $(BIN)/.installed
	$(BIN)/ruff check --fix .
	$(BIN)/ruff format .

$(BIN)/.installed: pyproject.toml
	$(PYTHON) -m venv .venv
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --editable '.[test]'
	@touch $@

clean:
	rm -rf .venv $(OUT) .mypy_cache .pytest_cache .ruff_cache .hypothesis
