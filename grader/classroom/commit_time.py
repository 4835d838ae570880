"""The time of a git repository's last commit. git runs in the sandbox: a repository's settings can start programs."""

from __future__ import annotations

import datetime as dt
import shutil
from pathlib import Path

from grader import sandbox
from grader.host import submission_user, tempdir

_INSIDE = "/repository"
_ENVIRONMENT = {"PATH": "/usr/bin:/bin", "HOME": "/tmp", "GIT_CONFIG_NOSYSTEM": "1"}
_GIT = ("git", "--no-pager", "-c", "safe.directory=*", f"--git-dir={_INSIDE}")


def last_commit(repository: Path) -> dt.datetime | None:
    """Return when the last commit was made, as its author's machine said, or None if there is none."""
    with tempdir.folder("repository") as scratch, submission_user.readable_by_sandboxes():
        # A copy, because a clone may be readable by its owner alone, and the sandbox's user is another one.
        copy = scratch / "git"
        try:
            if not (repository / ".git").is_dir():
                return None
            shutil.copytree(repository / ".git", copy, symlinks=True, copy_function=shutil.copyfile)
        except OSError:  # the grading of this one says what cannot be read
            return None
        scratch.chmod(0o755)
        box = sandbox.Sandbox(read_only={copy: _INSIDE}, environment=_ENVIRONMENT)
        command = [*_GIT, "log", "-1", "--format=%cI", "--no-show-signature"]
        ended = sandbox.run(command, box, sandbox.Limits(wall_seconds=20.0))
    try:
        return dt.datetime.fromisoformat(ended.output.strip()) if ended.ok else None
    except ValueError:
        return None
