# %% [markdown]
# # An example
#
# ![What will be there at the end](pictures/00.png)
#
# **You will be able to** write a file that holds a number.
#
# **Time**: a minute.

# %%
import os
from pathlib import Path

os.chdir(os.environ["ROS2_COURSE_WS"])


def check(name):
    text = Path("answer.py").read_text() if Path("answer.py").exists() else ""
    print(f"{name} passed (5 of 5)" if "42" in text else f"{name} not yet (0 of 5): expected 42 in {Path.cwd()}")


# %% [markdown]
# ## Stop before the wall
#
# Predict what this shows.

# %%
print("one", flush=True)
print("two")

# %% tags=["given"]
# %%writefile given.py
"""A file that the course gives."""

# %% tags=["exercise"]
# %%writefile answer.py
"""Hold the answer."""
# TODO 1: the number
ANSWER = 0

# %% tags=["check"]
check("F4")

# %% [markdown]
# <details><summary>Hint 1</summary>Where to look.</details>
# <details><summary>Hint 2</summary>The formula.</details>
# <details><summary>Hint 3</summary>All but the last line.</details>

# %% [markdown]
# ## Recall
#
# What is the answer?
#
# <details><summary>Answer</summary>42.</details>
