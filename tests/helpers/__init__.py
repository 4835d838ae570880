"""What several tests share: examples, runs of commands, notebooks."""
