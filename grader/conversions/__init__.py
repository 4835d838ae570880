"""Call the package's own functions in a sandbox and bring back what they return. Data only, no verdicts."""
