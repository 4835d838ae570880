# `make grade` and `make test` set up what is missing; nothing needs to be done before.

# A sourced ROS installation or another virtual environment must not shine through.
unexport PYTHONPATH PYTHONHOME AMENT_PREFIX_PATH CMAKE_PREFIX_PATH COLCON_PREFIX_PATH VIRTUAL_ENV
unexport ROS_DISTRO ROS_VERSION ROS_PYTHON_VERSION ROS_DOMAIN_ID RMW_IMPLEMENTATION _ROS_WHEELS_BOOTSTRAP_COMPLETE
unexport PYTEST_ADDOPTS PYTEST_PLUGINS
export PYTHONUTF8 = 1

BIN := .venv/bin
REFERENCE := solution_pkg/ros2_robot_controller
# `make test ARGS="-k lidar"` hands pytest more; .ci/run names a file in STATUS to get pytest's own exit status.
ARGS :=
STATUS :=
PYTEST = $(BIN)/python -m pytest $(ARGS) $(if $(STATUS),; echo $$? >"$(STATUS)")

.DEFAULT_GOAL := help
.PHONY: help setup jupyter notebooks grade test test-all faults lint format lock doctor clean clean-all

help:  ## Show this list
	@sed -n 's/^\([a-z-]*\):.*## \(.*\)/  make \1\t\2/p' Makefile | expand -t 18

setup:  ## Set up what is missing (.venv, bubblewrap); `make setup PYTHON=python3.12` picks the interpreter
	@PYTHON="$(PYTHON)" .ci/setup

jupyter: setup  ## Open the course in JupyterLab
	@$(BIN)/jupyter lab --notebook-dir=. notebooks/00_first_drive.ipynb

notebooks: setup  ## Make the notebooks from notebooks/source, run and stored; NN="04 05" makes just those
	@$(BIN)/python -m grader.authoring.book build $(NN)

grade: setup  ## Grade the reference package; the report lies in out/reference
	@$(BIN)/grader grade $(REFERENCE) --out out/reference

doctor: setup  ## Say what this machine has and lacks
	@$(BIN)/grader doctor

test: ARGS += -m "not slow"
test: setup  ## Run the tests, but for the slow ones
	@$(PYTEST)

test-all: setup  ## Run all tests
	@$(PYTEST)

faults: setup  ## Grade the reference with each named fault; print what each costs (takes an hour)
	@PYTHONPATH=.:tests $(BIN)/python -m submissions.table

lint: setup  ## Check style and types, as CI does
	@$(BIN)/ruff format --check .
	@$(BIN)/ruff check .
	@$(BIN)/mypy

format: setup  ## Put the code into its form, and mend what ruff can mend
	@$(BIN)/ruff format .
	@$(BIN)/ruff check --fix .

# Keeps the versions that requirements.txt has; UPGRADE=--upgrade takes newer ones. The result names no index, no path.
lock: setup  ## Pin the versions of pyproject.toml's dependencies in requirements.txt
	@test -x .kit/uv/bin/uv || { $(BIN)/python -m venv .kit/uv && .kit/uv/bin/pip install --quiet uv; }
	@.kit/uv/bin/uv pip compile pyproject.toml --extra dev --universal --python-version 3.11 $(UPGRADE) \
	    --no-emit-index-url --no-emit-find-links --no-header --quiet --output-file requirements.txt
	@! grep -nE '://|^ *-(i|f|-index-url|-find-links)|@ ' requirements.txt

clean:  ## Take away what the other commands made, but for .venv
	@rm -rf out .kit .pytest_cache .mypy_cache .ruff_cache .hypothesis .coverage
	@find grader sim tests solution_pkg -name __pycache__ -prune -exec rm -rf {} +

clean-all: clean  ## Take .venv away too
	@rm -rf .venv *.egg-info
