"""The engine room: jobs, what is kept of them, who computes when, and the end of the processes that do it."""
