# `make demo` and `make test` set up everything themselves from a bare Python 3.11+.
PYTHON ?= python3
BPY_PYTHON ?= python3.11
BIN := .venv/bin
OUT := demo-out
FUZZ_SECONDS ?= 14400
PAGE := anim/show/page/bundle/page.js
export PATH := $(CURDIR)/$(BIN):$(PATH)
# Some images set it; pytest would compile all tests anew in each run.
unexport PYTHONDONTWRITEBYTECODE

.PHONY: demo test slow fuzz docs page blender format clean

demo: $(BIN)/.installed $(PAGE)
	@$(BIN)/python -m fixtures $(OUT)/fixtures 2>/dev/null
	@sh fixtures/demo.sh $(OUT)/fixtures/biped.glb $(OUT)

# mypy uses one core only, so the tests run beside it.
test: $(BIN)/.installed $(PAGE)
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy & types=$$!; $(BIN)/python -m pytest -n auto --dist loadfile -m "not slow"; tests=$$?; \
	  wait $$types && exit $$tests

# What takes minutes: real files under three bounds, judged by three.js, kills. CI runs it too.
slow: $(BIN)/.installed $(PAGE)
	$(BIN)/python -m pytest -n auto -m slow

# Other random examples of the properties than the gate's, then absurd values of all options (about ten minutes), and
# mutations of fixtures for hours; inputs with faults go to fuzz-out (`python -m tests.fuzz --help`).
fuzz: $(BIN)/.installed $(PAGE)
	$(BIN)/python -m pytest -n auto --dist loadfile -m "not slow" --hypothesis-profile random
	$(BIN)/python -m tests.fuzz --options --keep fuzz-out
	$(BIN)/python -m tests.fuzz --seconds $(FUZZ_SECONDS) --seed $$(date +%s) --keep fuzz-out

# The reference of commands, and the pages' pictures and output.
docs: $(BIN)/.installed
	$(BIN)/python -m docs.generate
	$(BIN)/python -m docs.pages

# The script of `view`'s pages, by npm; made with the installation, and again where its sources are newer.
page: $(PAGE)

$(PAGE): $(wildcard anim/show/page/web/*.js*) | $(BIN)/.installed
	-@$(BIN)/python -m anim.show.page.build --if-older

# Blender's module, which plays what we write in some slow tests: 370 MB, for one version of Python, so in its own venv.
blender: .venv-blender/.installed

format: $(BIN)/.installed
	$(BIN)/ruff check --fix .
	$(BIN)/ruff format .

$(BIN)/.installed: pyproject.toml
	$(PYTHON) -m venv .venv
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --editable '.[test]'
	@touch $@

.venv-blender/.installed: Makefile
	$(BPY_PYTHON) -m venv .venv-blender
	.venv-blender/bin/python -m pip install --quiet --disable-pip-version-check 'bpy==5.0.*'
	.venv-blender/bin/python -c 'import bpy'
	@touch $@

clean:
	rm -rf .venv .venv-blender $(OUT) fuzz-out .mypy_cache .pytest_cache .ruff_cache .hypothesis
