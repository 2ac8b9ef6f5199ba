# SPDX-License-Identifier: BSD-3-Clause
"""mypy --strict passes over the examples and over what the docs show."""

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

import dyop

pytest.importorskip("mypy")
ROOT = Path(__file__).parents[2]
CONFIG = """[mypy]
strict = True
[mypy-matplotlib.*,distributed.*,torch.*]
ignore_missing_imports = True
follow_imports = skip
"""


def snippets():
    """The Python shown in the docs, by a name for each piece."""
    for page in [ROOT / "README.md", *sorted((ROOT / "docs").rglob("*.md"))]:
        for number, text in enumerate(re.findall(r"```python\n(.*?)```", page.read_text(), re.S)):
            yield f"{page.stem.lower().replace('-', '_')}_{number}.py", text


@pytest.fixture(scope="module")
def cache(tmp_path_factory):
    """What mypy knows of other modules, read once."""
    return tmp_path_factory.mktemp("mypy_cache")


def check(files, folder, cache):
    (folder / "mypy.ini").write_text(CONFIG)
    environment = dict(os.environ, MYPYPATH=str(Path(dyop.__file__).parents[1]))
    command = [sys.executable, "-m", "mypy", "--config-file", "mypy.ini", "--cache-dir", str(cache)]
    command += map(str, files)
    done = subprocess.run(command, cwd=folder, env=environment, capture_output=True, text=True)
    assert done.returncode == 0, done.stdout + done.stderr


def test_examples(tmp_path, cache):
    examples = sorted((ROOT / "examples" / "python").glob("*.py"))
    assert len(examples) >= 8
    check(examples, tmp_path, cache)


def test_snippets_of_the_docs(tmp_path, cache):
    files = []
    for name, text in snippets():
        files.append(tmp_path / name)
        files[-1].write_text(text)
    assert {"readme_0.py", "python_0.py", "robots_0.py"} <= {file.name for file in files}
    check(files, tmp_path, cache)


def test_wrong_types_are_noticed(tmp_path, cache):
    (tmp_path / "wrong.py").write_text(
        'import dyop\ndyop.Sphere("1")\ndyop.ToiOptions(colour=1)\ndyop.Box("1", 2)\n'
    )
    with pytest.raises(AssertionError, match="Found 3 errors"):
        check([tmp_path / "wrong.py"], tmp_path, cache)
