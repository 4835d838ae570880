"""Put faults into a package's source and see whether its own tests notice. Behaviour-preserving decoys keep it fair."""

from grader.mutation.mutant_run import FAULTS, SECONDS, mutate

__all__ = ["FAULTS", "SECONDS", "mutate"]
