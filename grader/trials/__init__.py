"""Trials: what is done to a robot and its node. `catalog.trials()` lists them; each is a short script over a Stage."""
