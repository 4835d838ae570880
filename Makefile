# `make grade` and `make test` first set up whatever is missing.

# Keep a sourced ROS installation or another virtual environment out of the recipes.
unexport PYTHONPATH PYTHONHOME AMENT_PREFIX_PATH CMAKE_PREFIX_PATH COLCON_PREFIX_PATH VIRTUAL_ENV
unexport ROS_DISTRO ROS_VERSION ROS_PYTHON_VERSION ROS_DOMAIN_ID RMW_IMPLEMENTATION _ROS_WHEELS_BOOTSTRAP_COMPLETE
unexport PYTEST_ADDOPTS PYTEST_PLUGINS
# With it, each process of each run of the tests compiles all of them anew: 4 s of CPU time.
unexport PYTHONDONTWRITEBYTECODE
export PYTHONUTF8 = 1

BIN := .venv/bin
REFERENCE := solution_pkg/ros2_robot_controller
# The folder of `make grade`'s report: make grade OUT=out/again
OUT := out/reference
# More arguments for pytest: make test ARGS="-k lidar"
ARGS :=
# Tests run make themselves; with these variables inherited it would print "Entering directory".
PARALLEL := -n auto --maxprocesses 3 --dist loadfile
QUICK := not slow and not notebooks
PYTEST = env -u MAKELEVEL -u MAKEFLAGS -u MFLAGS $(BIN)/python -m pytest
# JupyterLab refuses to run as root, which is the user in most containers, unless told to.
AS_ROOT := $(if $(filter 0,$(shell id -u)),--allow-root)

.DEFAULT_GOAL := help
.PHONY: help setup jupyter notebooks grade test test-notebooks test-all known-bad hunt evidence words lint format lock doctor clean clean-all

help:  ## Show this list
	@sed -n 's/^\([a-z-]*\):.*## \(.*\)/  make \1\t\2/p' Makefile | expand -t 18

setup:  ## Set up whatever is missing (.venv, bubblewrap); PYTHON=python3.12 picks the interpreter
	@PYTHON="$(PYTHON)" .ci/setup

jupyter: setup  ## Open the course in JupyterLab
	@$(BIN)/jupyter lab $(AS_ROOT) --notebook-dir=. --LabApp.default_url=/lab/tree/notebooks/00_first_drive.ipynb

notebooks: setup  ## Make both editions of the notebooks from notebooks/source; NN="04 05" makes only those
	@$(BIN)/python -m grader.authoring.book build $(NN)

grade: setup  ## Grade the reference package; the report goes to out/reference or OUT=folder
	@$(BIN)/grader grade $(REFERENCE) --out "$(OUT)"

doctor: setup  ## Report what this machine has and lacks
	@$(BIN)/grader doctor

test: setup  ## Run the tests of every commit, five minutes; ARGS="-k lidar" narrows them down
	@$(PYTEST) -m "$(QUICK)" $(PARALLEL) $(ARGS)

test-notebooks: setup  ## Run the notebooks of both editions, but for the two short ones that `make test` runs
	@$(PYTEST) -m notebooks tests/notebooks $(ARGS)

test-all: setup  ## Run all tests
	@$(PYTEST) $(ARGS)

known-bad: setup  ## Grade every known-bad submission and print what each loses (takes an hour)
	@PYTHONPATH=.:tests $(BIN)/python -m submissions.table

hunt: setup  ## Hunt in the reference, its variants and every known-bad submission (takes hours)
	@PYTHONPATH=.:tests $(BIN)/python -m submissions.hunted --again 20

evidence: setup  ## Record the evidence in tests/evidence again (takes half an hour)
	@PYTHONPATH=.:tests $(BIN)/python -m submissions.record

words: setup  ## Bring the German catalogues up to date, and name the texts that they lack
	@PYTHONPATH=.:tests $(BIN)/python -m helpers.messages

lint: setup  ## Check style and types, as CI does
	@$(BIN)/ruff format --check .
	@$(BIN)/ruff check .
	@$(BIN)/mypy
	@$(BIN)/mypy --config-file tests/mypy.ini

format: setup  ## Format the code and fix what ruff can fix
	@$(BIN)/ruff format .
	@$(BIN)/ruff check --fix .

# Keeps the versions that requirements.txt has; UPGRADE=--upgrade takes newer ones. The result names no index and no path.
# lark-parser, which rosidl_parser asks for, is an old lark under another name, with the same files: which of the two
# was there afterwards was decided by chance. rosidl_parser runs with the new one, as on Ubuntu 24.04.
# rfc3987-syntax is a check of URIs that jsonschema makes do without; with it, each program that reads a notebook
# compiles a grammar when it starts, which takes 3 s of CPU time.
lock: setup  ## Pin the versions of pyproject.toml's dependencies in requirements.txt
	@$(BIN)/uv pip compile pyproject.toml --extra dev --universal --python-version 3.11 $(UPGRADE) \
	    --no-emit-package lark-parser --no-emit-package rfc3987-syntax --no-emit-index-url --no-emit-find-links \
	    --no-header --quiet --output-file requirements.txt
	@sed -i -e '1i # What `make setup` installs: every package with its version, for CPython 3.11 to 3.14 on Linux.' \
	    -e '1i # Written by `make lock` from pyproject.toml; do not edit. "via" names the packages that ask for one.' \
	    -e '/^$$/,$$d' requirements.txt
	@! grep -nE '://|^ *-(i|f|-index-url|-find-links)|@ ' requirements.txt

clean:  ## Remove what the other commands made, except .venv
	@rm -rf out .kit .pytest_cache .mypy_cache .ruff_cache .hypothesis .coverage
	@find grader sim tests solution_pkg -name __pycache__ -prune -exec rm -rf {} +

clean-all: clean  ## Remove .venv as well
	@rm -rf .venv *.egg-info
