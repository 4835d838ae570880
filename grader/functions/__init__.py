"""Call functions of the package in a sandbox and record what they return. Data only, no verdicts."""
