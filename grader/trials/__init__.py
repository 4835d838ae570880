"""Trials: what is done to a robot and its node. Each is a short script over a Stage; `catalog.trials()` lists them."""
