"""The blocks of a page of docs/, as a reader takes them."""

import os
import re
import subprocess
from pathlib import Path

DOCS = Path(__file__).parents[2] / "docs"


def blocks(page: str) -> list[tuple[str, str]]:
    """Kind and text of each fenced block, in order."""
    return re.findall(r"^```(\w+)\n(.*?)^```$", (DOCS / page).read_text(), re.MULTILINE | re.DOTALL)


def shell(command: str, folder: Path) -> str:
    """Runs commands of a page in bash, and returns what they print on both outputs."""
    done = subprocess.run(["bash", "-euo", "pipefail", "-c", command], cwd=folder, capture_output=True, text=True, env=os.environ)
    if done.returncode:
        raise SystemExit(f"newcomer: a command failed ({done.returncode}):\n{command}\n{done.stdout}{done.stderr}")
    return done.stdout + done.stderr
