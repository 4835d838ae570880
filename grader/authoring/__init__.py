"""The course's own machinery: the workspace, the stages of the package, sessions with its nodes, and feedback."""
