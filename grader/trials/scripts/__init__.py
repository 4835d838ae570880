"""The trials' scripts. To add a trial, add a decorated function to a file here, or a new file."""
