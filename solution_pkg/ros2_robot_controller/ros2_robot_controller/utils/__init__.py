"""The decisions behind the nodes: plain functions that a test can call without a robot."""
