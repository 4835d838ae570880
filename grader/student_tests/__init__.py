"""The package's own tests: read (never run) here, run in a sandbox, their coverage measured by our configuration."""
