"""The package's own tests: read as text here, run in a sandbox, their coverage measured with our configuration."""
