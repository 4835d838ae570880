"""Call the package's own functions in a sandbox and record what they return. Data only, no verdicts."""
